// Hair meshes: which instruction set's solver a processor gets.
#include "kernels/hairmesh/hair_mesh_model.h"
#include "kernels/launch/hair_mesh_solver.h"

namespace ringlet::kernels {

#define RINGLET_DECLARE(isa)                                                 \
  namespace isa {                                                            \
  HairMeshSolver<float>* new_float_mesh(const HairMeshView<float>& mesh);    \
  HairMeshSolver<double>* new_double_mesh(const HairMeshView<double>& mesh); \
  }
RINGLET_DECLARE(generic)
RINGLET_DECLARE(avx2)
RINGLET_DECLARE(avx512)
#undef RINGLET_DECLARE

// Here and not in the class: it must not be compiled for an instruction set.
template <class T>
HairMeshSolver<T>::~HairMeshSolver() = default;
template class HairMeshSolver<float>;
template class HairMeshSolver<double>;

template <>
std::unique_ptr<HairMeshSolver<float>> make_hair_mesh_solver(InstructionSet set,
                                                             const HairMeshTopology& topology,
                                                             const std::vector<double>& rest,
                                                             const HairMeshParameters& parameters) {
  const HairMeshModel<float> model(topology, rest, parameters);
  const auto make = set == InstructionSet::kAvx512 ? avx512::new_float_mesh
                    : set == InstructionSet::kAvx2 ? avx2::new_float_mesh
                                                   : generic::new_float_mesh;
  return std::unique_ptr<HairMeshSolver<float>>(make(model.view()));
}
template <>
std::unique_ptr<HairMeshSolver<double>> make_hair_mesh_solver(InstructionSet set,
                                                              const HairMeshTopology& topology,
                                                              const std::vector<double>& rest,
                                                              const HairMeshParameters& parameters) {
  const HairMeshModel<double> model(topology, rest, parameters);
  const auto make = set == InstructionSet::kAvx512 ? avx512::new_double_mesh
                    : set == InstructionSet::kAvx2 ? avx2::new_double_mesh
                                                   : generic::new_double_mesh;
  return std::unique_ptr<HairMeshSolver<double>>(make(model.view()));
}

}  // namespace ringlet::kernels
