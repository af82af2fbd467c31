// Lane types and words of the common subset in OpenCL C 1.2 (design: one lane-generic source for two languages).
//
// LANES rays or points are handled by one work item: real, integer, mask and word are vectors of LANES
// elements (scalars for LANES 1). A mask is 0 or -1 per lane (0 or 1 for LANES 1): select with it, never
// calculate with it. Contraction is off, so that error-free transformations hold; multiply_add says where it may fuse.
#pragma OPENCL FP_CONTRACT OFF

#define JOIN_(a, b) a##b
#define JOIN(a, b) JOIN_(a, b)

// Clang's builtins where it compiles for a processor; SPIR-V has no word for some of them.
#if defined(__has_builtin) && (defined(__x86_64__) || defined(__aarch64__))
#define HAS_BUILTIN(name) __has_builtin(name)
#else
#define HAS_BUILTIN(name) 0
#endif

#if LANES == 1
#define real float
#define integer int
#define mask int
#define word uint
#define to_real(i) ((float)(i))
#define to_integer(r) ((int)(r))
#define to_word(i) ((uint)(i))
#define to_signed(w) ((int)(w))
#define as_real(w) as_float(w)
#define as_word(r) as_uint(r)
#define any_lane(m) (m)
#define mask_all() 1
#define mask_none() 0
#else
#define real JOIN(float, LANES)
#define integer JOIN(int, LANES)
#define mask JOIN(int, LANES)
#define word JOIN(uint, LANES)
#define to_real(i) JOIN(convert_float, LANES)(i)
#define to_integer(r) JOIN(convert_int, LANES)(r)
#define to_word(i) JOIN(as_uint, LANES)(i)
#define to_signed(w) JOIN(as_int, LANES)(w)
#define as_real(w) JOIN(as_float, LANES)(w)
#define as_word(r) JOIN(as_uint, LANES)(r)
#if HAS_BUILTIN(__builtin_reduce_or)
#define any_lane(m) (__builtin_reduce_or(m) != 0)
#else
#define any_lane(m) any(m)
#endif
#define mask_all() ((mask)(-1))
#define mask_none() ((mask)(0))
#endif

// Whether a driver may be at work that ends long loops (Mesa's llvmpipe, under rusticl).
#if defined(__x86_64__) || defined(__aarch64__)
#define CHECK_LOOPS 0
#else
#define CHECK_LOOPS 1
#endif

// The least of all lanes, as a plain number.
#if LANES == 1
#define least_lane(i) (i)
#elif HAS_BUILTIN(__builtin_reduce_min)
#define least_lane(i) __builtin_reduce_min(i)
#else
static inline int least_lane(integer i) {
  int lanes[LANES];
  JOIN(vstore, LANES)(i, 0, lanes);
  int least = lanes[0];
  for (int lane = 1; lane < LANES; lane++) least = min(least, lanes[lane]);
  return least;
}
#endif

#define as_plain_real(i) as_float(i)

// Lanes one by one: the least and greatest of all, that of number i, and a mask as bits.
#if LANES == 1
#define lane_least(v) (v)
#define lane_greatest(v) (v)
#define lane_real(v, i) (v)
#define lane_integer(v, i) (v)
#define lane_splat(v, i) (v)
#define lane_numbers() 0
#define lane_bits(m) ((m) ? 1 : 0)
#else
// By halves: what compilers make of a reduction that minds NaN goes from lane to lane, at ten times the cost.
#define LESSER_HALF(v) ((v).lo < (v).hi ? (v).lo : (v).hi)
static inline float lane_least(real v) {
#if LANES == 16
  float8 eight = LESSER_HALF(v);
  float4 four = LESSER_HALF(eight);
#elif LANES == 8
  float4 four = LESSER_HALF(v);
#else
  float4 four = v;
#endif
  float2 two = LESSER_HALF(four);
  return LESSER_HALF(two);
}
#define lane_greatest(v) (-lane_least(-(v)))
static inline float lane_real(real v, int i) { return ((float*)&v)[i]; }
static inline int lane_integer(integer v, int i) { return ((int*)&v)[i]; }
// That of number i on all lanes.
#if LANES == 16 && defined(__AVX512F__) && HAS_BUILTIN(__builtin_ia32_permvarsf512)
#define lane_splat(v, i) __builtin_ia32_permvarsf512(v, (int16)(i))
#elif LANES == 8 && defined(__AVX2__) && HAS_BUILTIN(__builtin_ia32_permvarsf256)
#define lane_splat(v, i) __builtin_ia32_permvarsf256(v, (int8)(i))
#else
#define lane_splat(v, i) ((real)(lane_real(v, i)))
#endif
#define lane_numbers() lane_items(0)
#if LANES == 16 && defined(__AVX512DQ__) && HAS_BUILTIN(__builtin_ia32_cvtd2mask512)
#define lane_bits(m) ((int)(uint)__builtin_ia32_cvtd2mask512(m))
#elif LANES == 8 && defined(__AVX__) && HAS_BUILTIN(__builtin_ia32_movmskps256)
#define lane_bits(m) __builtin_ia32_movmskps256(as_float8(m))
#elif LANES == 4 && defined(__SSE__) && HAS_BUILTIN(__builtin_ia32_movmskps)
#define lane_bits(m) __builtin_ia32_movmskps(as_float4(m))
#else
static inline int lane_bits(mask m) {
  int bits = 0;
  for (int lane = 0; lane < LANES; lane++) bits |= ((int*)&m)[lane] != 0 ? 1 << lane : 0;
  return bits;
}
#endif
#endif
// A list of LANES integers, one for each lane; and of each lane the value on lane number i of v, with i of its own.
#if LANES == 1
#define lanes_of(list) ((list)[0])
#define lane_reals_of(v, i) (v)
#define lane_integers_of(v, i) (v)
#else
#define lanes_of(list) JOIN(vload, LANES)(0, list)
#if LANES == 16 && defined(__AVX512F__) && HAS_BUILTIN(__builtin_ia32_permvarsf512) && \
    HAS_BUILTIN(__builtin_ia32_permvarsi512)
#define lane_reals_of(v, i) __builtin_ia32_permvarsf512(v, i)
#define lane_integers_of(v, i) __builtin_ia32_permvarsi512(v, i)
#elif LANES == 8 && defined(__AVX2__) && HAS_BUILTIN(__builtin_ia32_permvarsf256) && \
    HAS_BUILTIN(__builtin_ia32_permvarsi256)
#define lane_reals_of(v, i) __builtin_ia32_permvarsf256(v, i)
#define lane_integers_of(v, i) __builtin_ia32_permvarsi256(v, i)
#else
static inline real lane_reals_of(real v, integer i) {
  real all;
  for (int lane = 0; lane < LANES; lane++) ((float*)&all)[lane] = lane_real(v, lane_integer(i, lane));
  return all;
}
static inline integer lane_integers_of(integer v, integer i) {
  integer all;
  for (int lane = 0; lane < LANES; lane++) ((int*)&all)[lane] = lane_integer(v, lane_integer(i, lane));
  return all;
}
#endif
#endif
// Puts the values of the lanes whose bits are set into a list, one after the other from place `at` on; LANES places are
// written.
#if LANES == 1
#define pack_integers(list, at, v, bits) ((list)[at] = (v))
#define pack_reals(list, at, v, bits) ((list)[at] = (v))
#elif LANES == 16 && defined(__AVX512F__) && HAS_BUILTIN(__builtin_ia32_compresssi512_mask) && \
    HAS_BUILTIN(__builtin_ia32_compresssf512_mask)
// vstore16 would take the vector apart.
typedef int16 UnalignedIntegers __attribute__((aligned(4)));
typedef float16 UnalignedReals __attribute__((aligned(4)));
#define pack_integers(list, at, v, bits) \
  (*(UnalignedIntegers*)((list) + (at)) = __builtin_ia32_compresssi512_mask(v, (int16)(0), (ushort)(bits)))
#define pack_reals(list, at, v, bits) \
  (*(UnalignedReals*)((list) + (at)) = __builtin_ia32_compresssf512_mask(v, (float16)(0), (ushort)(bits)))
#else
static inline void pack_integers(int* list, int at, integer v, int bits) {
  for (; bits != 0; bits &= bits - 1) list[at++] = lane_integer(v, 31 - (int)clz(bits & -bits));
}
static inline void pack_reals(float* list, int at, real v, int bits) {
  for (; bits != 0; bits &= bits - 1) list[at++] = lane_real(v, 31 - (int)clz(bits & -bits));
}
#endif
#define bit_count(bits) ((int)popcount(bits))
// The number of the lowest bit that is set; there must be one.
#define lowest_bit(bits) (31 - (int)clz((bits) & -(bits)))

#define splat(x) ((real)(x))
#define splat_integer(x) ((integer)(x))
#define splat_word(x) ((word)(x))
#define count_bits(w) to_signed(popcount(w))
#define abs_real(x) fabs(x)
#define sqrt_real(x) sqrt(x)

#define FN static inline __attribute__((always_inline))
#define FN_SHARED static __attribute__((noinline))  // long, and called from many places: compiled once
#define STRUCT(name)        \
  typedef struct name name; \
  struct name
#define UNROLL _Pragma("unroll")
// A table of plain numbers: CONSTANT_REALS(name, n) = {...};
#define CONSTANT_REALS(name, n) __constant float name[n]
// Loops over the stages of a method, whose bodies are long.
#define STAGE_LOOP _Pragma("unroll")
// The head of a kernel of kernels.def; what it takes, the assembler says.
#define KERNEL(name) __kernel __attribute__((reqd_work_group_size(GROUP, 1, 1))) void name(KERNEL_PARAMETERS)
#define work_item() ((int)get_global_id(0))

// a*b + c, fused where that is fast; for results that may differ in the last place between devices.
#if defined(FP_FAST_FMAF) || defined(__FMA__)
#define multiply_add(a, b, c) fma(a, b, c)
// Rounding error of a*b, exact, where p is the rounded product.
#define product_error(a, b, p) fma(a, b, -(p))
#else
#define multiply_add(a, b, c) ((a) * (b) + (c))
// Dekker 1971: split both factors into halves of 12 bits, whose products are exact.
FN real split_high(real a) {
  real c = 4097.0f * a;
  return c - (c - a);
}
FN real product_error(real a, real b, real p) {
  real a_high = split_high(a);
  real b_high = split_high(b);
  real a_low = a - a_high;
  real b_low = b - b_high;
  return ((a_high * b_high - p) + a_high * b_low + a_low * b_high) + a_low * b_low;
}
#endif
// Rounding error of a + b, exact, where s is the rounded sum (Knuth).
FN real sum_error(real a, real b, real s) {
  real v = s - a;
  return (a - (s - v)) + (b - v);
}

// A buffer of 32-bit words. Indices must be valid on every lane.
#define Buffer __global uint*

#define load_uniform_word(b, i) ((b)[i])
#define load_uniform_integer(b, i) ((int)(b)[i])
#define load_uniform_real(b, i) as_float((b)[i])

// Says that the words about this one will be wanted.
#if HAS_BUILTIN(__builtin_prefetch)
#define load_ahead(b, i) __builtin_prefetch((void const*)(ulong)((b) + (i)))
#else
#define load_ahead(b, i)
#endif

// A gather over lanes. Where the compiler offers the processor's own instruction it is asked for by name: spelled out,
// sixteen loads a gather cost the optimizer most of a program's compile time.
#if LANES == 1
#define GATHER(b, i) (b)[i]
#elif LANES == 16 && defined(__AVX512F__) && HAS_BUILTIN(__builtin_ia32_gathersiv16si)
#define GATHER(b, i) as_uint16(__builtin_ia32_gathersiv16si((int16)(0), (void const*)(ulong)(b), i, (ushort)0xffff, 4))
#elif LANES == 8 && defined(__AVX2__) && HAS_BUILTIN(__builtin_ia32_gatherd_d256)
#define GATHER(b, i) as_uint8(__builtin_ia32_gatherd_d256((int8)(0), (int const*)(ulong)(b), i, (int8)(-1), 4))
#elif LANES == 4 && defined(__AVX2__) && HAS_BUILTIN(__builtin_ia32_gatherd_d)
#define GATHER(b, i) as_uint4(__builtin_ia32_gatherd_d((int4)(0), (int const*)(ulong)(b), i, (int4)(-1), 4))
#elif LANES == 4
#define GATHER(b, i) (uint4)((b)[(i).s0], (b)[(i).s1], (b)[(i).s2], (b)[(i).s3])
#elif LANES == 8
#define GATHER(b, i) \
  (uint8)((b)[(i).s0], (b)[(i).s1], (b)[(i).s2], (b)[(i).s3], (b)[(i).s4], (b)[(i).s5], (b)[(i).s6], (b)[(i).s7])
#elif LANES == 16
#define GATHER(b, i)                                                                                               \
  (uint16)((b)[(i).s0], (b)[(i).s1], (b)[(i).s2], (b)[(i).s3], (b)[(i).s4], (b)[(i).s5], (b)[(i).s6], (b)[(i).s7], \
           (b)[(i).s8], (b)[(i).s9], (b)[(i).sa], (b)[(i).sb], (b)[(i).sc], (b)[(i).sd], (b)[(i).se], (b)[(i).sf])
#endif
FN word load_word(Buffer b, integer i) { return GATHER(b, i); }
FN integer load_integer(Buffer b, integer i) { return to_signed(load_word(b, i)); }
FN real load_real(Buffer b, integer i) { return as_real(load_word(b, i)); }

// Four consecutive reals on each lane, from start + i on, or from where table[at + lane] says, a multiple of four, and
// up to three more, which do not count. Whole rows and a transposition cost a quarter of four gathers.
STRUCT(Row) { real at[4]; };
#if LANES == 1
FN Row load_row(Buffer b, int start, integer i) {
  float4 v = vload4(0, (__global float*)b + start + i);
  Row row;
  row.at[0] = v.s0;
  row.at[1] = v.s1;
  row.at[2] = v.s2;
  row.at[3] = v.s3;
  return row;
}
FN Row load_listed_row(Buffer b, Buffer table, int at) { return load_row(b, 0, (int)(table[at] & ~3u)); }
#elif HAS_BUILTIN(__builtin_shufflevector)
#define ROW_TRANSPOSED 1
// Places are read one by one, which volatile asks for: clang otherwise gathers some of them, or keeps them in a vector,
// and takes that apart again.
#define ROW_AT(lane) vload4(0, reals + ((volatile int*)places)[0x##lane])
#define ROW_TO(lane, v) vstore4(v, 0, reals + i.s##lane)
#define ROW_LISTED(lane) vload4(0, reals + (((volatile __global uint*)table)[at + 0x##lane] & ~3u))
#if LANES == 4
#define ROW_LOW 0, 4, 1, 5
#define ROW_HIGH 2, 6, 3, 7
#define ROW_FRONT 0, 1, 4, 5
#define ROW_BACK 2, 3, 6, 7
#define ROW_ALL(AT) AT(0), AT(1), AT(2), AT(3)
#define ROW_STORE(r) ROW_TO(0, r[0]), ROW_TO(1, r[1]), ROW_TO(2, r[2]), ROW_TO(3, r[3])
#elif LANES == 8
#define ROW_LOW 0, 8, 1, 9, 4, 12, 5, 13
#define ROW_HIGH 2, 10, 3, 11, 6, 14, 7, 15
#define ROW_FRONT 0, 1, 8, 9, 4, 5, 12, 13
#define ROW_BACK 2, 3, 10, 11, 6, 7, 14, 15
#define ROW_GROUPS(AT, n, m) (real)(AT(n), AT(m))
#define ROW_ALL(AT) ROW_GROUPS(AT, 0, 4), ROW_GROUPS(AT, 1, 5), ROW_GROUPS(AT, 2, 6), ROW_GROUPS(AT, 3, 7)
#define ROW_GROUPS_TO(n, m, r) ROW_TO(n, (r).lo), ROW_TO(m, (r).hi)
#define ROW_STORE(r) \
  ROW_GROUPS_TO(0, 4, r[0]), ROW_GROUPS_TO(1, 5, r[1]), ROW_GROUPS_TO(2, 6, r[2]), ROW_GROUPS_TO(3, 7, r[3])
#elif LANES == 16
#define ROW_LOW 0, 16, 1, 17, 4, 20, 5, 21, 8, 24, 9, 25, 12, 28, 13, 29
#define ROW_HIGH 2, 18, 3, 19, 6, 22, 7, 23, 10, 26, 11, 27, 14, 30, 15, 31
#define ROW_FRONT 0, 1, 16, 17, 4, 5, 20, 21, 8, 9, 24, 25, 12, 13, 28, 29
#define ROW_BACK 2, 3, 18, 19, 6, 7, 22, 23, 10, 11, 26, 27, 14, 15, 30, 31
#define ROW_GROUPS(AT, n, m, o, p) (real)((float8)(AT(n), AT(m)), (float8)(AT(o), AT(p)))
#define ROW_ALL(AT) \
  ROW_GROUPS(AT, 0, 4, 8, c), ROW_GROUPS(AT, 1, 5, 9, d), ROW_GROUPS(AT, 2, 6, a, e), ROW_GROUPS(AT, 3, 7, b, f)
#define ROW_GROUPS_TO(n, m, o, p, r) \
  ROW_TO(n, (r).lo.lo), ROW_TO(m, (r).lo.hi), ROW_TO(o, (r).hi.lo), ROW_TO(p, (r).hi.hi)
#define ROW_STORE(r)                                                                                 \
  ROW_GROUPS_TO(0, 4, 8, c, r[0]), ROW_GROUPS_TO(1, 5, 9, d, r[1]), ROW_GROUPS_TO(2, 6, a, e, r[2]), \
      ROW_GROUPS_TO(3, 7, b, f, r[3])
#endif
// Lane 4n+m stands in group n of r<m>; each group is transposed by itself.
FN Row row_transposed(real r0, real r1, real r2, real r3) {
  real low_01 = __builtin_shufflevector(r0, r1, ROW_LOW);
  real high_01 = __builtin_shufflevector(r0, r1, ROW_HIGH);
  real low_23 = __builtin_shufflevector(r2, r3, ROW_LOW);
  real high_23 = __builtin_shufflevector(r2, r3, ROW_HIGH);
  Row row;
  row.at[0] = __builtin_shufflevector(low_01, low_23, ROW_FRONT);
  row.at[1] = __builtin_shufflevector(low_01, low_23, ROW_BACK);
  row.at[2] = __builtin_shufflevector(high_01, high_23, ROW_FRONT);
  row.at[3] = __builtin_shufflevector(high_01, high_23, ROW_BACK);
  return row;
}
FN Row load_row(Buffer b, int start, integer i) {
  __global float* reals = (__global float*)b + start;
  int places[LANES];
  JOIN(vstore, LANES)(i, 0, places);
  return row_transposed(ROW_ALL(ROW_AT));
}
FN Row load_listed_row(Buffer b, Buffer table, int at) {
  __global float* reals = (__global float*)b;
  return row_transposed(ROW_ALL(ROW_LISTED));
}
#else
FN Row load_row(Buffer b, int start, integer i) {
  Row row;
  row.at[0] = load_real(b + start, i);
  row.at[1] = load_real(b + start, i + 1);
  row.at[2] = load_real(b + start, i + 2);
  row.at[3] = load_real(b + start, i + 3);
  return row;
}
FN Row load_listed_row(Buffer b, Buffer table, int at) {
  return load_row(b, 0, JOIN(as_int, LANES)(JOIN(vload, LANES)(0, table + at) & ~3u));
}
#endif

// Reals from `start` on, at indices that follow each other in fours of lanes, and words that are stored so: a few whole
// loads in place of a gather.
#if LANES == 1
#define load_fours(b, start, i) load_real(b, (start) + (i))
#define store_fours(b, start, i, v) ((b)[(start) + (i)] = (v))
#elif LANES == 4
#define load_fours(b, start, i) vload4(0, (__global float*)(b) + (start) + (i).s0)
#define store_fours(b, start, i, v) vstore4(v, 0, (b) + (start) + (i).s0)
#elif LANES == 8
FN real load_fours(Buffer b, int start, integer i) {
  __global float* reals = (__global float*)b + start;
  return (real)(vload4(0, reals + i.s0), vload4(0, reals + i.s4));
}
FN void store_fours(Buffer b, int start, integer i, word v) {
  vstore4(v.lo, 0, b + start + i.s0);
  vstore4(v.hi, 0, b + start + i.s4);
}
#elif LANES == 16
FN real load_fours(Buffer b, int start, integer i) {
  __global float* reals = (__global float*)b + start;
  return (real)(vload4(0, reals + i.s0), vload4(0, reals + i.s4), vload4(0, reals + i.s8), vload4(0, reals + i.sc));
}
FN void store_fours(Buffer b, int start, integer i, word v) {
  vstore4(v.s0123, 0, b + start + i.s0);
  vstore4(v.s4567, 0, b + start + i.s4);
  vstore4(v.s89ab, 0, b + start + i.s8);
  vstore4(v.scdef, 0, b + start + i.sc);
}
#endif

// LANES reals, or integers, that follow each other.
#if LANES == 1
#define load_lanes(b, start) as_float((b)[start])
#define load_lane_integers(b, start) ((int)(b)[start])
#define store_lane_integers(b, start, v) ((b)[start] = (uint)(v))
#else
#define load_lanes(b, start) JOIN(vload, LANES)(0, (__global float*)(b) + (start))
#define load_lane_integers(b, start) JOIN(vload, LANES)(0, (__global int*)(b) + (start))
typedef integer __attribute__((aligned(4))) lane_integers;  // one store, where vstore may become several
#define store_lane_integers(b, start, v) (*(__global lane_integers*)((b) + (start)) = (v))
#endif

// Reals of a row, load_real(b, start + i), of one that has no more than PICK_FEW, and of one that has no more than
// twice as many: read as whole vectors, beyond its end.
#if LANES == 16 && defined(__AVX512F__) && HAS_BUILTIN(__builtin_ia32_permvarsf512) && \
    HAS_BUILTIN(__builtin_ia32_vpermi2varps512)
#define PICK_FEW 16
#define pick_few(b, start, i) __builtin_ia32_permvarsf512(load_lanes(b, start), i)
#define pick_some(b, start, i) __builtin_ia32_vpermi2varps512(load_lanes(b, start), i, load_lanes(b, (start) + 16))
#elif LANES == 8 && defined(__AVX2__) && HAS_BUILTIN(__builtin_ia32_permvarsf256)
#define PICK_FEW 8
#define pick_few(b, start, i) __builtin_ia32_permvarsf256(load_lanes(b, start), i)
#define pick_some(b, start, i) load_real(b, (start) + (i))
#else
#define PICK_FEW 0
#define pick_few(b, start, i) load_real(b, (start) + (i))
#define pick_some(b, start, i) load_real(b, (start) + (i))
#endif

// Stores the lanes in m.
#if LANES == 1
FN void store_word(Buffer b, integer i, word v, mask m) {
  if (m) b[i] = v;
}
#elif LANES == 16 && defined(__AVX512DQ__) && HAS_BUILTIN(__builtin_ia32_scattersiv16si) && \
    HAS_BUILTIN(__builtin_ia32_cvtd2mask512)
FN void store_word(Buffer b, integer i, word v, mask m) {
  __builtin_ia32_scattersiv16si((void*)(ulong)b, __builtin_ia32_cvtd2mask512(m), i, as_int16(v), 4);
}
#else
FN void store_word(Buffer b, integer i, word v, mask m) {
  int index[LANES];
  uint value[LANES];
  int wanted[LANES];
  JOIN(vstore, LANES)(i, 0, index);
  JOIN(vstore, LANES)(v, 0, value);
  JOIN(vstore, LANES)(m, 0, wanted);
  for (int lane = 0; lane < LANES; lane++) {
    if (wanted[lane]) b[index[lane]] = value[lane];
  }
}
#endif
FN void store_integer(Buffer b, integer i, integer v, mask m) { store_word(b, i, to_word(v), m); }
FN void store_real(Buffer b, integer i, real v, mask m) { store_word(b, i, as_word(v), m); }

// Four consecutive reals on each lane in m, as load_row reads them.
FN void store_row(Buffer b, int start, integer i, Row row, mask m) {
#ifdef ROW_TRANSPOSED
  if (!any_lane(!m)) {
    __global float* reals = (__global float*)b + start;
    Row lanes = row_transposed(row.at[0], row.at[1], row.at[2], row.at[3]);
    ROW_STORE(lanes.at);
    return;
  }
#endif
  for (int k = 0; k < 4; k++) store_real(b + start, i + k, row.at[k], m);
}
// The same of integers.
STRUCT(IntegerRow) { integer at[4]; };
FN IntegerRow load_integer_row(Buffer b, int start, integer i) {
  Row row = load_row(b, start, i);
  IntegerRow integers;
  for (int k = 0; k < 4; k++) integers.at[k] = to_signed(as_word(row.at[k]));
  return integers;
}
FN void store_integer_row(Buffer b, int start, integer i, IntegerRow integers, mask m) {
  Row row;
  for (int k = 0; k < 4; k++) row.at[k] = as_real(to_word(integers.at[k]));
  store_row(b, start, i, row, m);
}
#define uniform_word(i) ((uint)(i))
#define to_plain_signed(w) ((int)(w))
#define store_uniform_word(b, i, v) ((b)[i] = (v))
#define store_uniform_integer(b, i, v) ((b)[i] = (uint)(v))
#define store_uniform_real(b, i, v) ((b)[i] = as_uint(v))

// The items of work item i: LANES consecutive ones.
#if LANES == 1
#define lane_items(i) ((int)(i))
#elif LANES == 4
#define lane_items(i) ((int)(i)*4 + (int4)(0, 1, 2, 3))
#elif LANES == 8
#define lane_items(i) ((int)(i)*8 + (int8)(0, 1, 2, 3, 4, 5, 6, 7))
#elif LANES == 16
#define lane_items(i) ((int)(i)*16 + (int16)(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15))
#endif

#include "prelude/fours_opencl.inc"
