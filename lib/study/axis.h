// What a study varies: `--vary POINTER=V1,V2,...`, or a setting of the command line in the pointer's place.
#pragma once
#include <string>
#include <vector>

#include "pipeline/simulation.h"

namespace ringlet::study {

// The machine's settings of a run.
struct Machine {
  pipeline::Options options;
  int threads = 0;  // 0: as many as the machine has
};

struct Value {
  std::string text;  // as the user wrote it
  std::string json;  // the same as JSON: what does not parse as such is a string
};

struct Axis {
  std::string name;  // a JSON pointer into the scene; or precision, backend, threads, instruction-set
  std::vector<Value> values;

  bool of_scene() const { return name.starts_with('/'); }
};

// Reads one `--vary`. Commas within brackets, braces and double quotes do not part values. Throws
// Error{kUsage}: no `=`, no value, neither a JSON pointer nor a setting, a value that the setting lacks.
Axis parse_axis(const std::string& text);

// Whether a pointer is to what frames there are and when: frames of the same number would be of other times.
bool of_frames(const std::string& pointer);

// Sets one of the command line's settings, whose value parse_axis has checked.
void set_machine(const std::string& setting, const std::string& value, Machine& machine);

// The value of a setting as the command line would give it; of what it leaves open: auto, all, widest.
std::string machine_value(const std::string& setting, const Machine& machine);

// Short names of axes for labels: the last token of the pointer, or as many as tell them apart and are not
// mere indices.
std::vector<std::string> short_names(const std::vector<Axis>& axes);

}  // namespace ringlet::study
