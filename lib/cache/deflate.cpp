#include "cache/deflate.h"

#include <zlib.h>

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <stdexcept>

namespace ringlet::cache {
namespace {

static_assert(std::endian::native == std::endian::little, "chunks are written in the host's byte order");

constexpr int kPlanes = sizeof(float);
constexpr double kStoredEntropy =
    6.5;  // [bits per byte] planes above it are stored: they would shrink by a fifth at most

std::vector<unsigned char> shuffle(std::span<const float> values) {
  const std::size_t n = values.size();
  std::vector<unsigned char> planes(n * kPlanes);
  for (int plane = 0; plane < kPlanes; ++plane) {
    unsigned char* out = planes.data() + plane * n;
    for (std::size_t i = 0; i < n; ++i)
      out[i] = static_cast<unsigned char>(std::bit_cast<std::uint32_t>(values[i]) >> (8 * plane));
  }
  return planes;
}

// Shannon's entropy of the bytes taken one by one [bits per byte], from every eighth.
double entropy(std::span<const unsigned char> bytes) {
  constexpr std::size_t kStride = 8;
  std::array<std::uint32_t, 256> histogram{};
  for (std::size_t i = 0; i < bytes.size(); i += kStride) ++histogram[bytes[i]];
  const double samples = static_cast<double>((bytes.size() + kStride - 1) / kStride);
  double bits = 0;
  for (const std::uint32_t count : histogram) {
    if (count != 0) bits -= count * std::log2(count / samples);
  }
  return bits / samples;
}

// A zlib stream whose level changes from plane to plane.
class Deflater {
 public:
  explicit Deflater(std::size_t input) {
    if (deflateInit2(&stream_, 0, Z_DEFLATED, MAX_WBITS, MAX_MEM_LEVEL, Z_DEFAULT_STRATEGY) != Z_OK)
      throw std::bad_alloc();
    output_.resize(input + input / 64 +
                   4096);  // stored blocks cost 5 bytes in 65,535, fixed ones at most 1/64
    stream_.next_out = reinterpret_cast<unsigned char*>(output_.data());
    stream_.avail_out = static_cast<uInt>(output_.size());
  }
  ~Deflater() { deflateEnd(&stream_); }
  Deflater(const Deflater&) = delete;
  Deflater& operator=(const Deflater&) = delete;

  void append(std::span<unsigned char> bytes, int level) {
    require(deflateParams(&stream_, level, Z_DEFAULT_STRATEGY) == Z_OK);
    stream_.next_in = bytes.data();
    stream_.avail_in = static_cast<uInt>(bytes.size());
    require(deflate(&stream_, Z_NO_FLUSH) == Z_OK && stream_.avail_in == 0);
  }

  std::vector<std::byte> finish() {
    require(deflate(&stream_, Z_FINISH) == Z_STREAM_END);
    output_.resize(stream_.total_out);
    return std::move(output_);
  }

 private:
  static void require(bool done) {
    if (!done) throw std::logic_error("zlib refused a chunk");
  }

  z_stream stream_{};
  std::vector<std::byte> output_;
};

}  // namespace

std::vector<std::byte> shuffle_and_deflate(std::span<const float> chunk) {
  std::vector<unsigned char> planes = shuffle(chunk);
  Deflater deflater(planes.size());
  for (int plane = 0; plane < kPlanes; ++plane) {
    const std::span<unsigned char> bytes(planes.data() + plane * chunk.size(), chunk.size());
    deflater.append(bytes, entropy(bytes) > kStoredEntropy ? 0 : 1);
  }
  return deflater.finish();
}

double quantisation_step(double error) {
  return std::exp2(std::floor(std::log2(2 * error / std::sqrt(3.0))));
}

void quantise(std::span<float> values, double step) {
  for (float& value : values) value = static_cast<float>(std::rint(value / step) * step);
}

}  // namespace ringlet::cache
