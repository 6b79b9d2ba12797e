#include "kernels_support.h"

#include "kernels/strand/length_step.h"
#include "kernels/strand/strand_models.h"

namespace ringlet::kernels_testing {

template <class T>
const kernels::KernelTable<T>& scalar_kernels() {
  static const kernels::KernelTable<T> table = {
      [](const kernels::StrandStep<T>& step, int begin, int end, T* scratch) {
        for (int batch = begin; batch < end; ++batch)
          for (int lane = 0; lane < kernels::kLanes; ++lane)
            kernels::with_strand_model(step, [&](auto model) {
              using Model = typename decltype(model)::template For<T>;
              kernels::step_strands<Model, T>(step, batch, lane, scratch, 1);
            });
      },
      [](const kernels::ContactStep<T>& step, int begin, int end, T* scratch) {
        for (int batch = begin; batch < end; ++batch)
          for (int lane = 0; lane < kernels::kLanes; ++lane)
            kernels::collide_strands<T>(step, batch, lane, scratch, 1);
      },
      [](const kernels::WindStep<T>& step, int begin, int end, T*) {
        for (int batch = begin; batch < end; ++batch)
          for (int lane = 0; lane < kernels::kLanes; ++lane) kernels::blow<T>(step, batch, lane);
      },
      [](const kernels::ShelterStep<T>& step, int begin, int end, T*) {
        for (int batch = begin; batch < end; ++batch)
          for (int lane = 0; lane < kernels::kLanes; ++lane) kernels::shelter_strand(step, batch, lane);
      },
      [](const kernels::LengthStep<T>& step, int begin, int end, T* scratch) {
        for (int batch = begin; batch < end; ++batch)
          for (int lane = 0; lane < kernels::kLanes; ++lane)
            kernels::hold_lengths<T>(step, batch, lane, scratch, 1);
      }};
  return table;
}

template const kernels::KernelTable<float>& scalar_kernels();
template const kernels::KernelTable<double>& scalar_kernels();

}  // namespace ringlet::kernels_testing
