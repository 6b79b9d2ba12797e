#include "unit/pipeline_support.h"

#include <malloc.h>

#include <atomic>
#include <cstdlib>
#include <fstream>
#include <new>

namespace {
std::atomic<std::int64_t> sum{0};

void release(void* memory) {
  if (memory != nullptr) sum -= static_cast<std::int64_t>(malloc_usable_size(memory));
  std::free(memory);
}
}  // namespace

void* operator new(std::size_t size) {
  void* memory = std::malloc(size);
  if (memory == nullptr) throw std::bad_alloc();
  sum += static_cast<std::int64_t>(malloc_usable_size(memory));
  return memory;
}
void operator delete(void* memory) noexcept { release(memory); }
void operator delete(void* memory, std::size_t) noexcept { release(memory); }

namespace ringlet::pipeline_testing {

std::int64_t allocated() { return sum; }

void write_hair(const std::filesystem::path& to, std::int32_t strands, std::int32_t particles) {
  std::ofstream file(to, std::ios::binary);
  const auto put = [&](auto value) { file.write(reinterpret_cast<const char*>(&value), sizeof value); };
  put(strands);
  for (std::int32_t s = 0; s < strands; ++s) {
    put(particles);
    for (std::int32_t i = 0; i < particles; ++i)
      put(0.002f * static_cast<float>(s)), put(0.02f * static_cast<float>(i)),
          put(0.001f * static_cast<float>(i * s % 3));
  }
}

}  // namespace ringlet::pipeline_testing
