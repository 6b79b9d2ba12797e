// What a run is done with, beside its scene, and the words for it on command lines.
#pragma once
#include <map>
#include <string>
#include <vector>

namespace ringlet::pipeline {

enum class Backend { kAuto, kCpu, kCuda };
enum class Precision { kFloat, kDouble };

struct Options {
  Backend backend = Backend::kAuto;
  Precision precision = Precision::kFloat;
  std::string instruction_set;  // of the CPU: avx512, avx2, generic; empty: the widest there is
};

const std::map<std::string, Backend>& backend_words();
const std::map<std::string, Precision>& precision_words();
const std::vector<std::string>& instruction_set_words();
inline constexpr int kMostThreads = 4096;  // that may be asked for

}  // namespace ringlet::pipeline
