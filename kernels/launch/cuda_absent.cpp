// The CUDA backend of a program that was built without it.
#include "kernels/launch/cuda_kernels.h"

namespace ringlet::kernels {

namespace {
constexpr const char* kWhyNot = "built without CUDA";
}  // namespace

bool cuda_compiled() { return false; }

std::optional<CudaDevice> find_cuda_device(std::string* why_not) {
  if (why_not) *why_not = kWhyNot;
  return std::nullopt;
}

std::unique_ptr<CudaStrands> make_cuda_strands(const StrandBatches<float>&, CudaTiming) {
  throw CudaError(kWhyNot);
}

}  // namespace ringlet::kernels
