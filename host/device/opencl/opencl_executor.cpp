// The OpenCL executor: launches and transfers go through one in-order queue, so they happen in the order of the calls.
//
// Assumes that every kernel is declared with reqd_work_group_size(GROUP, 1, 1), where GROUP is what work_group()
// gives, and guards the work items beyond its count.
#include "device/opencl/opencl_executor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdlib>
#include <stdexcept>

#include "smurf/values.hpp"

namespace smurf::opencl {
namespace {

constexpr std::size_t word = 4;
constexpr std::size_t dummy_bytes = 256;
constexpr std::size_t most_pending_events = 512;
constexpr std::size_t log_lines = 6;

std::size_t whole_words(std::size_t bytes) { return std::max(word, (bytes + word - 1) / word * word); }

double mebibytes(std::size_t bytes) { return static_cast<double>(bytes) / (1024.0 * 1024.0); }

struct FreeResults {
  void operator()(void* memory) const noexcept { free_results(memory); }
};
using HostMemory = std::unique_ptr<void, FreeResults>;

class OpenclBuffer final : public DeviceBuffer {
 public:
  // In memory of the device, counted in the budget.
  OpenclBuffer(cl::Buffer buffer, std::size_t bytes, std::shared_ptr<std::atomic<std::size_t>> budget)
      : DeviceBuffer(bytes), buffer_(std::move(buffer)), budget_(std::move(budget)) {
    *budget_ += bytes;
  }
  // The same on a device that computes in the host's memory, which this buffer owns.
  OpenclBuffer(HostMemory memory, cl::Buffer buffer, std::size_t bytes, cl::CommandQueue queue,
               std::shared_ptr<std::atomic<std::size_t>> budget)
      : OpenclBuffer(std::move(buffer), bytes, std::move(budget)) {
    memory_ = std::move(memory);
    queue_ = std::move(queue);
  }
  // On the host's memory: once this is gone the caller may free or read that, so nothing may be running on it.
  OpenclBuffer(cl::Buffer buffer, std::size_t bytes, cl::CommandQueue queue)
      : DeviceBuffer(bytes), buffer_(std::move(buffer)), queue_(std::move(queue)) {}
  ~OpenclBuffer() override {
    if (budget_) *budget_ -= bytes();
    if (!queue_()) return;
    try {
      queue_.finish();
    } catch (const cl::Error&) {
      // A broken queue runs nothing any more, and the next call on the executor says so.
    }
  }
  OpenclBuffer(const OpenclBuffer&) = delete;
  OpenclBuffer& operator=(const OpenclBuffer&) = delete;

  const cl::Buffer& buffer() const { return buffer_; }

 private:
  HostMemory memory_;  // outlives buffer_
  cl::Buffer buffer_;
  std::shared_ptr<std::atomic<std::size_t>> budget_;
  cl::CommandQueue queue_;
};

const OpenclBuffer& own(const DeviceBuffer& buffer) {
  const auto* opencl_buffer = dynamic_cast<const OpenclBuffer*>(&buffer);
  if (!opencl_buffer) throw std::logic_error("a buffer of another executor was handed to OpenCL");
  return *opencl_buffer;
}

void require_inside(const DeviceBuffer& buffer, std::size_t offset, std::size_t bytes) {
  if (offset <= buffer.bytes() && bytes <= buffer.bytes() - offset) return;
  throw std::logic_error(
      fmt::format("a transfer of {} bytes at {} leaves a buffer of {} bytes", bytes, offset, buffer.bytes()));
}

// The first lines of a build log from the first error on, in one line.
std::string log_excerpt(const std::string& log) {
  std::vector<std::string> lines;
  bool error_seen = false;
  for (std::size_t begin = 0; begin < log.size() && lines.size() < log_lines;) {
    const auto end = std::min(log.find('\n', begin), log.size());
    std::string line = log.substr(begin, end - begin);
    begin = end + 1;
    if (!error_seen && line.find("error") != std::string::npos) {
      error_seen = true;
      lines.clear();
    }
    if (line.find_first_not_of(" \t\r") != std::string::npos) lines.push_back(std::move(line));
  }
  return lines.empty() ? "the build log is empty" : fmt::format("{}", fmt::join(lines, " | "));
}

// Division and square root to the last bit where the device offers it; nothing that relaxes arithmetic.
std::string build_options(const cl::Device& device) {
  std::string options = "-cl-std=CL1.2";
  if (device.getInfo<CL_DEVICE_SINGLE_FP_CONFIG>() & CL_FP_CORRECTLY_ROUNDED_DIVIDE_SQRT) {
    options += " -cl-fp32-correctly-rounded-divide-sqrt";
  }
  return options;
}

class Stopwatch {
 public:
  explicit Stopwatch(double& sum) : sum_(sum) {}
  ~Stopwatch() { sum_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count(); }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;

 private:
  double& sum_;
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
};

}  // namespace

OpenclExecutor::OpenclExecutor(FoundDevice found, const DeviceOptions& options)
    : found_(std::move(found)),
      timing_(options.timing || std::getenv("SMURF_TIMING") != nullptr),
      is_pocl_(found_.info.platform.find("Portable Computing Language") != std::string::npos),
      bytes_in_use_(std::make_shared<std::atomic<std::size_t>>(0)) {
  guarded(fmt::format("opening opencl:{} ({})", found_.info.index, found_.info.name), [&] {
    const cl::Device& device = found_.device;
    context_ = cl::Context(device);
    queue_ = cl::CommandQueue(context_, device, timing_ ? CL_QUEUE_PROFILING_ENABLE : cl_command_queue_properties{0});
    largest_group_ = std::max<std::size_t>(1, device.getInfo<CL_DEVICE_MAX_WORK_GROUP_SIZE>());
    if (const auto sizes = device.getInfo<CL_DEVICE_MAX_WORK_ITEM_SIZES>(); !sizes.empty() && sizes[0] > 0) {
      largest_group_ = std::min<std::size_t>(largest_group_, sizes[0]);
    }
    build_options_ = build_options(device);
    compiler_ = fmt::format("{}\n{}\n{}\n{}\n{}", found_.info.platform, found_.info.name,
                            device.getInfo<CL_DEVICE_VERSION>(), device.getInfo<CL_DRIVER_VERSION>(), build_options_);
    dummy_ = cl::Buffer(context_, CL_MEM_READ_WRITE, dummy_bytes);
  });
}

OpenclExecutor::~OpenclExecutor() {
  try {
    queue_.finish();
  } catch (const cl::Error&) {
    // Nothing is left to be told.
  }
}

void OpenclExecutor::require_memory(std::size_t bytes, bool counted, std::string_view purpose) const {
  const DeviceInfo& device = found_.info;
  if (device.largest_allocation != 0 && bytes > device.largest_allocation) {
    throw Error(ErrorCode::memory,
                fmt::format("{} needs {:.1f} MiB in one buffer; {} allows {:.1f} MiB in one buffer", purpose,
                            mebibytes(bytes), device.name, mebibytes(device.largest_allocation)));
  }
  const std::size_t used = *bytes_in_use_;
  const std::size_t available = device.memory > used ? device.memory - used : 0;
  if (counted && device.memory != 0 && bytes > available) {
    throw Error(ErrorCode::memory,
                fmt::format("{} needs {:.1f} MiB; {} has {:.1f} MiB, of which {:.1f} MiB are available", purpose,
                            mebibytes(bytes), device.name, mebibytes(device.memory), mebibytes(available)));
  }
}

// PoCL's kernels write the host's memory in place: once they have ended, mapping it (OpenCL 1.2, 5.4.3) would only wake
// threads. Mesa 22.3's rusticl does not, and damages the heap beside it.
bool OpenclExecutor::writes_host_memory() const { return is_pocl_ && found_.info.shares_host_memory; }

std::unique_ptr<DeviceBuffer> OpenclExecutor::allocate(std::size_t bytes, std::string_view purpose) {
  const std::size_t size = whole_words(bytes);
  require_memory(std::max(size, bytes), true, purpose);
  return guarded(fmt::format("{} ({:.1f} MiB)", purpose, mebibytes(size)), [&]() -> std::unique_ptr<DeviceBuffer> {
    if (writes_host_memory()) {
      // On large pages: gathers from volumes otherwise spend their time looking up small ones.
      HostMemory memory(allocate_results(size));
      cl::Buffer buffer(context_, CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, size, memory.get());
      return std::make_unique<OpenclBuffer>(std::move(memory), std::move(buffer), size, queue_, bytes_in_use_);
    }
    return std::make_unique<OpenclBuffer>(cl::Buffer(context_, CL_MEM_READ_WRITE, size), size, bytes_in_use_);
  });
}

std::unique_ptr<DeviceBuffer> OpenclExecutor::share(const void* host, std::size_t bytes, std::string_view purpose) {
  // Kernels read whole words, so memory that ends or begins between words has to be copied.
  const bool words = bytes != 0 && bytes % word == 0 && reinterpret_cast<std::uintptr_t>(host) % word == 0;
  if (!words) {
    auto copy = allocate(bytes, purpose);
    write(*copy, 0, host, bytes);
    return copy;
  }
  void* memory = const_cast<void*>(host);  // OpenCL asks for it; READ_ONLY keeps kernels from writing
  const bool in_place = found_.info.shares_host_memory;
  require_memory(bytes, !in_place, purpose);
  return guarded(fmt::format("{} ({:.1f} MiB)", purpose, mebibytes(bytes)), [&]() -> std::unique_ptr<DeviceBuffer> {
    if (in_place) {
      return std::make_unique<OpenclBuffer>(cl::Buffer(context_, CL_MEM_READ_ONLY | CL_MEM_USE_HOST_PTR, bytes, memory),
                                            bytes, queue_);
    }
    return std::make_unique<OpenclBuffer>(cl::Buffer(context_, CL_MEM_READ_ONLY | CL_MEM_COPY_HOST_PTR, bytes, memory),
                                          bytes, bytes_in_use_);
  });
}

std::unique_ptr<DeviceBuffer> OpenclExecutor::share_results(void* host, std::size_t bytes, std::string_view purpose) {
  const bool words = bytes != 0 && bytes % word == 0 && reinterpret_cast<std::uintptr_t>(host) % word == 0;
  if (!words || !writes_host_memory()) return nullptr;
  return guarded(fmt::format("{} ({:.1f} MiB)", purpose, mebibytes(bytes)), [&]() -> std::unique_ptr<DeviceBuffer> {
    return std::make_unique<OpenclBuffer>(cl::Buffer(context_, CL_MEM_READ_WRITE | CL_MEM_USE_HOST_PTR, bytes, host),
                                          bytes, queue_);
  });
}

void OpenclExecutor::write(DeviceBuffer& buffer, std::size_t offset, const void* data, std::size_t bytes) {
  if (bytes == 0) return;
  require_inside(buffer, offset, bytes);
  guarded("writing to the device",
          [&] { queue_.enqueueWriteBuffer(own(buffer).buffer(), CL_TRUE, offset, bytes, data); });
}

void OpenclExecutor::read(const DeviceBuffer& buffer, std::size_t offset, void* data, std::size_t bytes) {
  if (bytes == 0) return;
  require_inside(buffer, offset, bytes);
  guarded("reading from the device",
          [&] { queue_.enqueueReadBuffer(own(buffer).buffer(), CL_TRUE, offset, bytes, data); });
}

void OpenclExecutor::prepare(const Program& program) { kernel_of(program); }

std::size_t OpenclExecutor::work_group(const KernelSpec& spec) const {
  const int items_per_work_item = spec.shape == KernelShape::lanes ? found_.info.lanes : 1;
  // Packets of lanes run one after the other; PoCL would keep what they remember in arrays over the work group, in
  // memory.
  if (items_per_work_item > 1) return 1;
  return std::min<std::size_t>(static_cast<std::size_t>(std::max(1, spec.group / items_per_work_item)), largest_group_);
}

void OpenclExecutor::launch(const Program& program, std::span<DeviceBuffer* const> buffers,
                            std::span<const std::int32_t> integers, std::size_t items) {
  const KernelSpec& spec = spec_of(program.kernel);
  const Bindings bindings = bindings_of(program);
  if (buffers.size() != bindings.buffers.size() || integers.size() != bindings.integers.size()) {
    throw std::logic_error(fmt::format("{} takes {} buffers and {} integers, not {} and {}", spec.name,
                                       bindings.buffers.size(), bindings.integers.size(), buffers.size(),
                                       integers.size()));
  }
  if (items == 0) return;
  cl::Kernel& kernel = kernel_of(program);
  guarded(fmt::format("launching {} on {}", spec.name, found_.info.name), [&] {
    cl_uint argument = 0;
    for (const DeviceBuffer* buffer : buffers) kernel.setArg(argument++, buffer ? own(*buffer).buffer() : dummy_);
    for (const cl_int integer : integers) kernel.setArg(argument++, integer);

    const auto lanes = spec.shape == KernelShape::lanes ? static_cast<std::size_t>(found_.info.lanes) : std::size_t{1};
    const std::size_t group = work_group(spec);
    const std::size_t groups = (items + lanes * group - 1) / (lanes * group);
    cl::Event event;
    queue_.enqueueNDRangeKernel(kernel, cl::NullRange, cl::NDRange(groups * group), cl::NDRange(group), nullptr,
                                timing_ ? &event : nullptr);
    queue_.flush();  // lets the device start while the host goes on
    if (timing_) pending_.emplace_back(spec.id, std::move(event));
  });
  if (pending_.size() >= most_pending_events) finish();
}

void OpenclExecutor::finish() {
  guarded("waiting for the device", [&] { queue_.finish(); });
  collect_times();
}

std::vector<KernelTime> OpenclExecutor::kernel_times() const {
  guarded("waiting for the device", [&] { queue_.finish(); });
  collect_times();
  std::vector<KernelTime> times;
  for (const auto& [id, time] : times_) times.push_back(time);
  return times;
}

// All pending launches have ended.
void OpenclExecutor::collect_times() const {
  guarded("reading kernel times", [&] {
    for (const auto& [id, event] : pending_) {
      KernelTime& time = times_[id];
      time.kernel = spec_of(id).name;
      time.launches++;
      const auto nanoseconds =
          event.getProfilingInfo<CL_PROFILING_COMMAND_END>() - event.getProfilingInfo<CL_PROFILING_COMMAND_START>();
      time.seconds += 1e-9 * static_cast<double>(nanoseconds);
    }
  });
  pending_.clear();
}

cl::Kernel& OpenclExecutor::kernel_of(const Program& program) {
  if (const auto found = kernels_.find(program); found != kernels_.end()) return found->second;
  const KernelSpec& spec = spec_of(program.kernel);
  const std::string source = assemble(program, Language::opencl, found_.info.lanes, static_cast<int>(work_group(spec)));
  const Stopwatch stopwatch(compile_seconds);
  const cl::Program built = build(program, source);
  cl::Kernel kernel = guarded(fmt::format("compiling {} for {}", spec.name, found_.info.name),
                              [&] { return cl::Kernel(built, std::string(spec.name).c_str()); });
  return kernels_.emplace(program, std::move(kernel)).first->second;
}

cl::Program OpenclExecutor::build(const Program& program, const std::string& source) {
  const std::string key = content_key(source, compiler_);
  dump_program(program, source, key, "cl");
  if (cl::Program cached = load(key); cached()) {
    programs_from_cache++;
    return cached;
  }
  return guarded(fmt::format("compiling {} for {}", spec_of(program.kernel).name, found_.info.name), [&] {
    cl::Program built(context_, source);
    try {
      built.build(std::vector<cl::Device>{found_.device}, build_options_.c_str());
    } catch (const cl::Error& error) {
      throw_build_failure(program, built, error);
    }
    programs_compiled++;
    store(key, built);
    return built;
  });
}

// Null if there is none in the cache, or if the driver refuses it (which it may, at any time).
cl::Program OpenclExecutor::load(const std::string& key) const {
  const auto cached = load_cached(key);
  if (!cached) return {};
  try {
    const auto* bytes = reinterpret_cast<const unsigned char*>(cached->data());
    const cl::Program::Binaries binaries = {std::vector<unsigned char>(bytes, bytes + cached->size())};
    cl::Program loaded(context_, {found_.device}, binaries);
    loaded.build(std::vector<cl::Device>{found_.device}, build_options_.c_str());
    return loaded;
  } catch (const cl::Error&) {
    return {};
  }
}

void OpenclExecutor::store(const std::string& key, const cl::Program& program) const {
  // PoCL generates code when it is asked for a binary, for any work-group size, and once more at the launch for
  // the size that is used: asking doubles the time to compile. It keeps a cache of its own, by source.
  if (is_pocl_) return;
  try {
    const auto binaries = program.getInfo<CL_PROGRAM_BINARIES>();
    if (binaries.size() == 1 && !binaries[0].empty()) store_cached(key, binaries[0].data(), binaries[0].size());
  } catch (const cl::Error&) {
    // A driver without binaries compiles again next time.
  }
}

void OpenclExecutor::throw_build_failure(const Program& program, const cl::Program& built,
                                         const cl::Error& error) const {
  std::string log;
  try {
    log = built.getBuildInfo<CL_PROGRAM_BUILD_LOG>(found_.device);
  } catch (const cl::Error&) {
    log.clear();
  }
  throw Error(ErrorCode::device,
              fmt::format("compiling {} for {}: {} failed with {} (SMURF_DUMP=folder writes the source): {}",
                          spec_of(program.kernel).name, found_.info.name, error.what(), code_name(error.err()),
                          log_excerpt(log)));
}

}  // namespace smurf::opencl

namespace smurf {

std::unique_ptr<Executor> open_opencl(std::string_view which, const DeviceOptions& options) {
  return std::make_unique<opencl::OpenclExecutor>(opencl::choose_device(which, options), options);
}

}  // namespace smurf
