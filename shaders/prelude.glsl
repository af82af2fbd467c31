// Lane types and words of the common subset in GLSL for Vulkan: kernels/prelude.cl with one lane, word for word.
//
// Buffers are references: 64-bit addresses that arrive as push constants (of kernels with many, in a table), with no
// limit on their size. Contraction is
// off (the SPIR-V is decorated for it after compilation), so that error-free transformations hold; multiply_add says
// where it may fuse.
#extension GL_EXT_buffer_reference : require
#extension GL_EXT_control_flow_attributes : require

#define real float
#define integer int
#define mask bool
#define word uint
#define to_real(i) float(i)
#define to_integer(r) int(r)
#define to_word(i) uint(i)
#define to_signed(w) int(w)
#define as_real(w) uintBitsToFloat(w)
#define as_word(r) floatBitsToUint(r)
#define any_lane(m) (m)
#define mask_all() true
#define mask_none() false

// Whether a driver may be at work that ends long loops (Mesa's llvmpipe).
#define CHECK_LOOPS 1

// The least of all lanes, as a plain number.
#define least_lane(i) (i)

#define as_plain_real(i) intBitsToFloat(i)

// Lanes one by one: there is one.
#define lane_least(v) (v)
#define lane_greatest(v) (v)
#define lane_real(v, i) (v)
#define lane_integer(v, i) (v)
#define lane_splat(v, i) (v)
#define lane_numbers() 0
#define lane_bits(m) ((m) ? 1 : 0)
#define lanes_of(list) list[0]
#define lane_reals_of(v, i) (v)
#define lane_integers_of(v, i) (v)
#define pack_integers(list, at, v, bits) list[at] = (v)
#define pack_reals(list, at, v, bits) list[at] = (v)
#define bit_count(bits) bitCount(bits)
#define lowest_bit(bits) findLSB(bits)

#define splat(x) float(x)
#define splat_integer(x) int(x)
#define splat_word(x) uint(x)
#define count_bits(w) bitCount(w)
#define abs_real(x) abs(x)
#define sqrt_real(x) sqrt(x)

#define FN
#define FN_SHARED
#define STRUCT(name) struct name
#define UNROLL [[unroll]]
// A table of plain numbers: CONSTANT_REALS(name, n) = {...};
#define CONSTANT_REALS(name, n) const float name[n]
// Loops over the stages of a method, whose bodies are long: drivers inline what is in them each time.
#define STAGE_LOOP [[dont_unroll]]

// a*b + c, fused where that is fast; for results that may differ in the last place between devices.
#define multiply_add(a, b, c) fma(a, b, c)
// Vulkan does not promise that fma rounds once, so products are taken apart without it.
// Dekker 1971: split both factors into halves of 12 bits, whose products are exact.
real split_high(real a) {
  precise real c = 4097.0f * a;
  precise real high = c - (c - a);
  return high;
}
// Rounding error of a*b, exact, where p is the rounded product.
real product_error(real a, real b, real p) {
  real a_high = split_high(a);
  real b_high = split_high(b);
  precise real a_low = a - a_high;
  precise real b_low = b - b_high;
  precise real error = ((a_high * b_high - p) + a_high * b_low + a_low * b_high) + a_low * b_low;
  return error;
}
// Rounding error of a + b, exact, where s is the rounded sum (Knuth).
real sum_error(real a, real b, real s) {
  precise real v = s - a;
  precise real error = (a - (s - v)) + (b - v);
  return error;
}

// A buffer of 32-bit words. Indices must be valid on every lane.
layout(buffer_reference, std430, buffer_reference_align = 4) buffer Buffer { uint words[]; };

#define load_uniform_word(b, i) ((b).words[i])
#define load_uniform_integer(b, i) int((b).words[i])
#define load_uniform_real(b, i) uintBitsToFloat((b).words[i])

// Says that the words about this one will be wanted.
#define load_ahead(b, i)

word load_word(Buffer b, integer i) { return b.words[i]; }
integer load_integer(Buffer b, integer i) { return int(b.words[i]); }
real load_real(Buffer b, integer i) { return uintBitsToFloat(b.words[i]); }

// Four consecutive reals, from start + i on, or from where table[at] says, a multiple of four, and up to three more,
// which do not count.
STRUCT(Row) { real at[4]; };
Row load_row(Buffer b, int start, integer i) {
  Row row;
  row.at[0] = load_real(b, start + i);
  row.at[1] = load_real(b, start + i + 1);
  row.at[2] = load_real(b, start + i + 2);
  row.at[3] = load_real(b, start + i + 3);
  return row;
}
Row load_listed_row(Buffer b, Buffer table, int at) { return load_row(b, 0, int(table.words[at] & ~3u)); }

#define load_fours(b, start, i) load_real(b, (start) + (i))
#define store_fours(b, start, i, v) ((b).words[(start) + (i)] = (v))

// LANES reals, or integers, that follow each other.
#define load_lanes(b, start) uintBitsToFloat((b).words[start])
#define load_lane_integers(b, start) int((b).words[start])
#define store_lane_integers(b, start, v) ((b).words[start] = uint(v))

#define PICK_FEW 0
#define pick_few(b, start, i) load_real(b, (start) + (i))
#define pick_some(b, start, i) load_real(b, (start) + (i))

// Stores the lanes in m.
void store_word(Buffer b, integer i, word v, mask m) {
  if (m) b.words[i] = v;
}
void store_integer(Buffer b, integer i, integer v, mask m) { store_word(b, i, uint(v), m); }
void store_real(Buffer b, integer i, real v, mask m) { store_word(b, i, floatBitsToUint(v), m); }
void store_row(Buffer b, int start, integer i, Row row, mask m) {
  for (int k = 0; k < 4; k++) store_real(b, start + i + k, row.at[k], m);
}
// The same of integers.
STRUCT(IntegerRow) { integer at[4]; };
IntegerRow load_integer_row(Buffer b, int start, integer i) {
  IntegerRow row;
  for (int k = 0; k < 4; k++) row.at[k] = load_integer(b, start + i + k);
  return row;
}
void store_integer_row(Buffer b, int start, integer i, IntegerRow row, mask m) {
  for (int k = 0; k < 4; k++) store_integer(b, start + i + k, row.at[k], m);
}
#define store_uniform_word(b, i, v) ((b).words[i] = (v))
#define uniform_word(i) uint(i)
#define to_plain_signed(w) int(w)
#define store_uniform_integer(b, i, v) ((b).words[i] = uint(v))
#define store_uniform_real(b, i, v) ((b).words[i] = floatBitsToUint(v))

// The items of work item i: one.
#define lane_items(i) int(i)

// The work item's number. Rows of work groups follow each other: one row alone is limited in length.
// (GROUP and not gl_WorkGroupSize, which is 1 as long as the layout has not been read.)
#define work_item() int((gl_WorkGroupID.y * gl_NumWorkGroups.x + gl_WorkGroupID.x) * GROUP + gl_LocalInvocationID.x)

// The head of a kernel of kernels.def; what it takes, the assembler says.
#define KERNEL(name)                                                 \
  void name(KERNEL_PARAMETERS);                                      \
  layout(local_size_x = GROUP) in;                                   \
  layout(push_constant) uniform Arguments{KERNEL_MEMBERS} arguments; \
  void main() { name(KERNEL_VALUES); }                               \
  void name(KERNEL_PARAMETERS)

#include "prelude/fours_glsl.inc"
