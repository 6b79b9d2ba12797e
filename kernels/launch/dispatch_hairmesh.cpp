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

namespace {

template <class T>
using Maker = HairMeshSolver<T>* (*)(const HairMeshView<T>& mesh);

template <class T>
struct Makers {
  Maker<T> generic, avx2, avx512;
};
template <class T>
constexpr Makers<T> kMakers{};
template <>
constexpr Makers<float> kMakers<float>{generic::new_float_mesh, avx2::new_float_mesh, avx512::new_float_mesh};
template <>
constexpr Makers<double> kMakers<double>{generic::new_double_mesh, avx2::new_double_mesh,
                                         avx512::new_double_mesh};

}  // namespace

template <class T>
std::unique_ptr<HairMeshSolver<T>> make_hair_mesh_solver(InstructionSet set, const HairMeshTopology& topology,
                                                         const std::vector<double>& rest,
                                                         const HairMeshParameters& parameters) {
  const HairMeshModel<T> model(topology, rest, parameters);
  const Maker<T> make = set == InstructionSet::kAvx512 ? kMakers<T>.avx512
                        : set == InstructionSet::kAvx2 ? kMakers<T>.avx2
                                                       : kMakers<T>.generic;
  return std::unique_ptr<HairMeshSolver<T>>(make(model.view()));
}

template std::unique_ptr<HairMeshSolver<float>> make_hair_mesh_solver(InstructionSet, const HairMeshTopology&,
                                                                      const std::vector<double>&,
                                                                      const HairMeshParameters&);
template std::unique_ptr<HairMeshSolver<double>> make_hair_mesh_solver(InstructionSet,
                                                                       const HairMeshTopology&,
                                                                       const std::vector<double>&,
                                                                       const HairMeshParameters&);

}  // namespace ringlet::kernels
