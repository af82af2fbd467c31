#include "io/volumes/nrrd_data.hpp"

#include <fmt/format.h>
#include <unistd.h>
#include <zlib.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "numerics/text_file.hpp"
#include "smurf/error.hpp"
#include "smurf/values.hpp"

namespace smurf {
namespace {

constexpr std::size_t greatest_deflate_ratio = 1032;  // zlib's technical notes: 1032:1 in the limit
constexpr std::size_t chunk = std::size_t(1) << 20;

struct Free {
  void operator()(void* memory) const { free_results(memory); }
};
using Samples = std::unique_ptr<void, Free>;

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& message) {
  throw Error(ErrorCode::input, fmt::format("\"{}\": {}", file.string(), message));
}

[[noreturn]] void fail_length(const std::filesystem::path& file, std::size_t expected, const std::string& got) {
  fail(file, fmt::format("the header asks for {} bytes of data, but there are {}", expected, got));
}

Samples allocate(const std::filesystem::path& file, std::size_t bytes) {
  try {
    return Samples(allocate_results(bytes));  // on large pages: kernels read volumes from here
  } catch (const std::bad_alloc&) {
    throw Error(ErrorCode::memory,
                fmt::format("\"{}\": {} bytes of memory are needed and not there", file.string(), bytes));
  }
}

// Where `lines` further lines have passed.
std::size_t skip_lines(const InputFile& file, std::size_t offset, std::size_t lines) {
  std::string buffer;
  while (lines > 0) {
    if (offset >= file.size()) fail(file.path(), "the file ends within the lines to be skipped");
    buffer.resize(std::min(chunk, file.size() - offset));
    file.read_at(offset, buffer.data(), buffer.size());
    std::size_t used = 0;
    for (; lines > 0 && used < buffer.size(); lines--) used = std::min(buffer.find('\n', used), buffer.size() - 1) + 1;
    if (used == buffer.size() && buffer.back() != '\n') lines++;  // the line goes on
    offset += used;
  }
  return offset;
}

// The place of `bytes` bytes in a stream of `total` that begins at `start`, by the rules of "byte skip".
std::size_t skip_bytes(const NrrdData& data, std::size_t start, std::size_t total, std::size_t bytes) {
  const std::size_t available = total - start;
  const bool from_end = data.byte_skip < 0;
  const std::size_t skipped = from_end ? std::size_t(-(data.byte_skip + 1)) : std::size_t(data.byte_skip);
  if (skipped > available)
    fail(data.file, fmt::format("byte skip is {}, but there are {} bytes", data.byte_skip, available));
  const std::size_t got = available - skipped;
  if (got < bytes || (got > bytes && !from_end)) fail_length(data.file, bytes, std::to_string(got));
  return from_end ? total - skipped - bytes : start + skipped;
}

Samples read_raw(const NrrdData& data, const InputFile& file, std::size_t start, std::size_t bytes) {
  const std::size_t offset = skip_bytes(data, start, file.size(), bytes);
  Samples samples = allocate(data.file, bytes);
  file.read_at(offset, samples.get(), bytes);
  return samples;
}

// A gzip stream that begins at an offset of a file.
class GzipStream {
 public:
  GzipStream(const InputFile& file, std::size_t start) : path_(file.path()) {
    unsigned char magic[2] = {0, 0};
    if (file.size() - start >= 2) file.read_at(start, magic, 2);
    if (magic[0] != 0x1f || magic[1] != 0x8b) fail(path_, "the data is not compressed by gzip");  // zlib would copy it
    const int descriptor = dup(file.descriptor());
    if (descriptor < 0 || lseek(descriptor, off_t(start), SEEK_SET) < 0) fail(path_, std::strerror(errno));
    stream_ = gzdopen(descriptor, "rb");
    if (stream_ == nullptr) {
      close(descriptor);
      throw Error(ErrorCode::memory, "no memory for decompression");
    }
    gzbuffer(stream_, 1 << 18);
  }
  ~GzipStream() { gzclose_r(stream_); }
  GzipStream(const GzipStream&) = delete;
  GzipStream& operator=(const GzipStream&) = delete;

  // As many of `bytes` as there are.
  std::size_t read(void* out, std::size_t bytes) {
    std::size_t filled = 0;
    while (filled < bytes) {
      const int got = gzread(stream_, static_cast<char*>(out) + filled, unsigned(std::min(bytes - filled, chunk)));
      int error = Z_OK;
      const char* reason = gzerror(stream_, &error);
      if (got < 0 || (error != Z_OK && error != Z_STREAM_END)) fail(path_, describe(error, reason));
      if (got == 0) break;
      filled += std::size_t(got);
    }
    return filled;
  }

  std::size_t skip(std::size_t bytes) {
    std::vector<char> discarded(std::min(bytes, chunk));
    std::size_t skipped = 0;
    while (skipped < bytes) {
      const std::size_t got = read(discarded.data(), std::min(bytes - skipped, chunk));
      if (got == 0) break;
      skipped += got;
    }
    return skipped;
  }

  void rewind() {
    if (gzrewind(stream_) != 0) fail(path_, "cannot be read a second time");
  }

 private:
  static std::string describe(int error, const char* reason) {
    if (error == Z_BUF_ERROR) return "the compressed data is truncated";
    return fmt::format("the compressed data is damaged ({})", reason != nullptr && *reason ? reason : "unknown error");
  }

  std::filesystem::path path_;
  gzFile stream_ = nullptr;
};

Samples read_gzip(const NrrdData& data, const InputFile& file, std::size_t start, std::size_t bytes) {
  const std::size_t compressed = file.size() - start;
  if (bytes / greatest_deflate_ratio > compressed)
    fail_length(data.file, bytes, fmt::format("only {}, compressed", compressed));
  GzipStream stream(file, start);
  std::size_t skipped = std::size_t(std::max(data.byte_skip, 0L));
  if (data.byte_skip < 0) {
    skipped = skip_bytes(data, 0, stream.skip(std::size_t(-1)), bytes);
    stream.rewind();
  }
  const std::size_t passed = stream.skip(skipped);
  if (passed < skipped) fail(data.file, fmt::format("byte skip is {}, but there are {} bytes", data.byte_skip, passed));
  Samples samples = allocate(data.file, bytes);
  const std::size_t got = stream.read(samples.get(), bytes);
  if (got < bytes) fail_length(data.file, bytes, std::to_string(got));
  char more = 0;  // also checks the checksum, which stands at the end
  if (data.byte_skip >= 0 && stream.read(&more, 1) != 0) fail_length(data.file, bytes, "more");
  return samples;
}

template <class T>
Samples parse_ascii(const NrrdData& data, std::string_view text, std::size_t count) {
  if (text.size() / 2 + 1 < count)  // a digit and a separator each
    fail(data.file,
         fmt::format("the header asks for {} samples, but there are only {} bytes of text", count, text.size()));
  Samples samples = allocate(data.file, count * sizeof(T));
  static constexpr std::string_view separators = " \t\r\n\v\f,";
  std::size_t position = text.find_first_not_of(separators), index = 0;
  for (; position != text.npos; index++) {
    if (index == count) fail(data.file, fmt::format("the header asks for {} samples, but there are more", count));
    const std::size_t end = std::min(text.find_first_of(separators, position), text.size());
    const std::string_view word = text.substr(position, end - position);
    T value{};
    const NumberParse parse = parse_number(word, value);
    if (parse != NumberParse::ok)
      fail(data.file, fmt::format("sample {} is \"{}\", which {}", index, word.substr(0, 40),
                                  parse == NumberParse::out_of_range ? "does not fit the type of the samples"
                                                                     : "is no number of the samples' type"));
    static_cast<T*>(samples.get())[index] = value;
    position = text.find_first_not_of(separators, end);
  }
  if (index < count) fail(data.file, fmt::format("the header asks for {} samples, but there are {}", count, index));
  return samples;
}

Samples read_ascii(const NrrdData& data, const InputFile& file, std::size_t start, SampleType type, std::size_t count) {
  if (data.byte_skip < 0) fail(data.file, "byte skip must not be negative for text");
  if (std::size_t(data.byte_skip) > file.size() - start)
    fail(data.file, "the file ends within the bytes to be skipped");
  start += std::size_t(data.byte_skip);
  std::string text(file.size() - start, '\0');
  file.read_at(start, text.data(), text.size());
  switch (type) {
    case SampleType::uint8:
      return parse_ascii<std::uint8_t>(data, text, count);
    case SampleType::int8:
      return parse_ascii<std::int8_t>(data, text, count);
    case SampleType::uint16:
      return parse_ascii<std::uint16_t>(data, text, count);
    case SampleType::int16:
      return parse_ascii<std::int16_t>(data, text, count);
    case SampleType::uint32:
      return parse_ascii<std::uint32_t>(data, text, count);
    case SampleType::int32:
      return parse_ascii<std::int32_t>(data, text, count);
    case SampleType::uint64:
      return parse_ascii<std::uint64_t>(data, text, count);
    case SampleType::int64:
      return parse_ascii<std::int64_t>(data, text, count);
    case SampleType::float32:
      return parse_ascii<float>(data, text, count);
    case SampleType::float64:
      return parse_ascii<double>(data, text, count);
  }
  throw std::logic_error("not a sample type");
}

}  // namespace

void* read_nrrd_data(const NrrdData& data, SampleType type, std::size_t count) {
  const InputFile file(data.file);
  const std::size_t start = skip_lines(file, std::min(data.header_bytes, file.size()), data.line_skip);
  const std::size_t bytes = count * size_of(type);
  if (data.encoding == NrrdData::Encoding::raw) return read_raw(data, file, start, bytes).release();
  if (data.encoding == NrrdData::Encoding::gzip) return read_gzip(data, file, start, bytes).release();
  return read_ascii(data, file, start, type, count).release();
}

}  // namespace smurf
