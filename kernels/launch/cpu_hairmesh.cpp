// The hair mesh for one instruction set: compiled once for each, with RINGLET_ISA naming it
// (kernels/CMakeLists.txt).
#include "kernels/hairmesh/hair_mesh_step.h"

namespace ringlet::kernels {
inline namespace RINGLET_ISA {

HairMeshSolver<float>* new_float_mesh(const HairMeshView<float>& mesh) {
  return new MeshStepper<float>(mesh);
}
HairMeshSolver<double>* new_double_mesh(const HairMeshView<double>& mesh) {
  return new MeshStepper<double>(mesh);
}

}  // namespace RINGLET_ISA
}  // namespace ringlet::kernels
