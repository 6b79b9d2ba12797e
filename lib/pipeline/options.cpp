#include "pipeline/options.h"

namespace ringlet::pipeline {

const std::map<std::string, Backend>& backend_words() {
  static const std::map<std::string, Backend> words = {
      {"auto", Backend::kAuto}, {"cpu", Backend::kCpu}, {"cuda", Backend::kCuda}};
  return words;
}

const std::map<std::string, Precision>& precision_words() {
  static const std::map<std::string, Precision> words = {{"float", Precision::kFloat},
                                                         {"double", Precision::kDouble}};
  return words;
}

const std::vector<std::string>& instruction_set_words() {
  static const std::vector<std::string> words = {"generic", "avx2", "avx512"};
  return words;
}

}  // namespace ringlet::pipeline
