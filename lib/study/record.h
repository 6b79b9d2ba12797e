// study.json and study.csv.
#pragma once
#include <string>
#include <vector>

#include "study/study.h"

namespace ringlet::study {

// study.json: the study and its answers. What was not measured is null.
std::string to_json(const Study& study);

// A row a run, the first line the columns' names: the varied pointers, ms_per_frame, the errors, ms_STAGE for
// every stage of any run, and what the run was. What was not measured is empty.
std::string to_csv(const Study& study);

// Of a study.json whose identity is the same: its rows, levels, float error and pressures, which are filled
// in. Rows by their keys; those that `study` does not have are passed over. Returns how many there were.
// Throws Error{kUsage} for another identity, with what differs, Error{kInput} for a file that is no study.
int take_over(const std::string& json, const std::string& file, Study& study);

// Substeps of the reference's levels whose caches a study.json's study may have left. Throws Error{kInput}
// for a file that is no study.
std::vector<int> levels_left(const std::string& json, const std::string& file);

const char* to_string(Status status);

}  // namespace ringlet::study
