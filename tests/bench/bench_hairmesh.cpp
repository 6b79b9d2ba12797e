// A frame of a hair mesh on one thread, at the sizes of the hair mesh paper: a head that turns and nods with
// shoulders beneath it, both ellipsoids, a step of 1/24 s, solves to 1e-4.
//
// The counters are milliseconds of a frame in each stage, iterations of its solves, and vertices moved out of
// the ellipsoids. Times are the thread's own, so that other programs do not count.
#include <benchmark/benchmark.h>
#include <time.h>

#include <string>

#include "kernels_hairmesh_support.h"

namespace ringlet::kernels_testing {
namespace {

constexpr int kFrames = 48;

double milliseconds() {
  timespec now;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

struct Totals {
  double assemble = 0, solve = 0, collide = 0, minimise = 0;
  double iterations = 0, minimise_iterations = 0, corrected = 0;
};

template <class T>
void frame(MeshRun<T>& run, int number, Totals& totals) {
  const double t = number / 24.0;
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.6 * std::sin(4 * t), Eigen::Vector3d(0.3, 1, 0.2).normalized()).toRotationMatrix();
  const Eigen::Vector3d at(0.1 * std::sin(3 * t), 0.03 * std::sin(7 * t), 0);
  run.head(turn, at);
  kernels::MeshEllipsoid<T> bodies[2] = {};
  for (kernels::MeshEllipsoid<T>& body : bodies)
    for (int k = 0; k < 3; ++k) body.axis[k][k] = 1, body.centre[k] = T(at[k]);
  for (int k = 0; k < 3; ++k) bodies[0].radius[k] = T(0.098), bodies[1].radius[k] = T(0.1);
  bodies[1].radius[0] = T(0.2), bodies[1].centre[1] -= T(0.16), bodies[1].friction = T(0.3);

  const double start = milliseconds();
  run.solver->assemble(run.step);
  const double assembled = milliseconds();
  const kernels::SolveFigures solved = run.solver->solve();
  const double moved = milliseconds();
  const kernels::MeshContactFigures contacts = run.solver->collide(bodies, 2);
  const double collided = milliseconds();
  const kernels::SolveFigures minimised = run.solver->minimise();
  const double end = milliseconds();
  totals.assemble += assembled - start, totals.solve += moved - assembled;
  totals.collide += collided - moved, totals.minimise += end - collided;
  totals.iterations += solved.iterations, totals.minimise_iterations += minimised.iterations;
  totals.corrected += contacts.corrected;
}

template <class T>
void hair_mesh(benchmark::State& state, InstructionSet set, int vertices) {
  if (set > kernels::best_instruction_set()) return state.SkipWithError("not on this processor");
  MeshRun<T> run(paper_mesh(vertices), {}, set);
  Totals totals;
  int frames = 0;
  for (auto _ : state) {
    run.set();
    for (int n = 1; n <= kFrames; ++n) frame(run, n, totals);
    frames += kFrames;
  }
  const auto per_frame = [&](double total) { return total / frames; };
  state.counters["frame_ms"] = per_frame(totals.assemble + totals.solve + totals.collide + totals.minimise);
  state.counters["assemble_ms"] = per_frame(totals.assemble);
  state.counters["solve_ms"] = per_frame(totals.solve);
  state.counters["collide_ms"] = per_frame(totals.collide);
  state.counters["minimise_ms"] = per_frame(totals.minimise);
  state.counters["iterations"] = per_frame(totals.iterations);
  state.counters["minimise_iterations"] = per_frame(totals.minimise_iterations);
  state.counters["corrected"] = per_frame(totals.corrected);
  state.counters["megabytes"] = static_cast<double>(run.solver->bytes()) * 1e-6;
}

const bool kRegistered = [] {
  for (const InstructionSet set : {InstructionSet::kGeneric, InstructionSet::kAvx2, InstructionSet::kAvx512})
    for (const int vertices : {215, 361, 2305}) {
      const std::string name = "hair_mesh/" + std::to_string(vertices) + "/" + kernels::name_of(set);
      benchmark::RegisterBenchmark((name + "/float").c_str(), hair_mesh<float>, set, vertices)
          ->Unit(benchmark::kMillisecond);
      benchmark::RegisterBenchmark((name + "/double").c_str(), hair_mesh<double>, set, vertices)
          ->Unit(benchmark::kMillisecond);
    }
  return true;
}();

}  // namespace
}  // namespace ringlet::kernels_testing
