#include "effects/executor.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include "effects/host_threads.h"
#include "effects/instruction_set.h"
#include "kernels/launch/hair_contacts.h"
#include "kernels/launch/hair_grid.h"
#include "kernels/launch/launch.h"

namespace ringlet::effects {
namespace {

using kernels::InstructionSet;

// Strands are independent: batches in any order on any thread give the same bits.
template <class T>
class CpuExecutor : public Executor<T> {
 public:
  CpuExecutor(const state::StrandModel<T>& model, InstructionSet set)
      : set_(set),
        kernels_(kernels::cpu_kernels<T>(set)),
        batches_(model.layout.batches()),
        scratch_(state::AlignedVector<T>(kernels::scratch_reals(model.layout.longest()))) {}

  std::string backend() const override { return "cpu"; }
  std::string instruction_set() const override { return kernels::name_of(set_); }
  void submit(const state::StrandState<T>&) override {}
  void submit_roots(const state::StrandState<T>&) override {}
  void fetch(state::StrandState<T>&) override {}
  void strand_step(const kernels::StrandStep<T>& step) override { run(kernels_.strand_step, step); }
  void contact_step(const kernels::ContactStep<T>& step, int) override { run(kernels_.contact_step, step); }
  void wind_step(const kernels::WindStep<T>& step) override { run(kernels_.wind_step, step); }
  void shelter_step(const kernels::ShelterStep<T>& step) override { run(kernels_.shelter_step, step); }
  void length_step(const kernels::LengthStep<T>& step) override { run(kernels_.length_step, step); }
  std::unique_ptr<kernels::HairGrid<T>> make_hair_grid() override {
    return kernels::make_hair_grid<T>(set_, host_threads());
  }
  std::unique_ptr<kernels::HairContacts<T>> make_hair_contacts() override {
    return kernels::make_hair_contacts<T>(set_, host_threads());
  }

 private:
  template <class Step>
  void run(void (*kernel)(const Step&, int, int, T*), const Step& step) {
    ++this->launches_;
    constexpr int kGrain = 8;  // batches: some 10 microseconds of work
    tbb::parallel_for(tbb::blocked_range<int>(0, batches_, kGrain),
                      [&](const tbb::blocked_range<int>& range) {
                        kernel(step, range.begin(), range.end(), scratch_.local().data());
                      });
  }

  InstructionSet set_;
  const kernels::KernelTable<T>& kernels_;
  int batches_;
  tbb::enumerable_thread_specific<state::AlignedVector<T>> scratch_;
};

}  // namespace

template <class T>
std::unique_ptr<Executor<T>> make_cpu_executor(const state::StrandModel<T>& model,
                                               const std::string& instruction_set) {
  return std::make_unique<CpuExecutor<T>>(model, choose_instruction_set(instruction_set));
}

template std::unique_ptr<Executor<float>> make_cpu_executor(const state::StrandModel<float>&,
                                                            const std::string&);
template std::unique_ptr<Executor<double>> make_cpu_executor(const state::StrandModel<double>&,
                                                             const std::string&);

}  // namespace ringlet::effects
