#include "solids/sequence.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/error.h"
#include "solids/import.h"
#include "solids/weld.h"

namespace ringlet::solids {
namespace {

// The frame number in `name`, or -1 where the pattern does not fit. Numbers too long for the pattern's digits
// may be longer, without zeros in front.
long long frame_number(const std::string& name, const std::string& before, std::size_t digits,
                       const std::string& after) {
  constexpr std::size_t kMaxDigits = 18;
  if (!name.starts_with(before) || !name.ends_with(after) || name.size() < before.size() + after.size())
    return -1;
  const std::string number = name.substr(before.size(), name.size() - before.size() - after.size());
  const bool all_digits =
      std::all_of(number.begin(), number.end(), [](char c) { return c >= '0' && c <= '9'; });
  const bool fits = number.size() == digits || (number.size() > digits && number.front() != '0');
  return all_digits && fits && number.size() <= kMaxDigits ? std::stoll(number) : -1;
}

std::vector<std::filesystem::path> files_of(const std::filesystem::path& pattern) {
  const std::string name = pattern.filename().string();
  const std::size_t begin = name.find('#'), end = name.find_last_of('#') + 1;
  const auto fail = [&pattern](const std::string& what, const std::string& hint) {
    throw Error(ErrorKind::kInput, pattern.string(), what, hint);
  };
  if (name.substr(begin, end - begin).find_first_not_of('#') != std::string::npos)
    fail("more than one run of # in the file's name", "one run stands for the frame number");
  std::map<long long, std::filesystem::path> found;
  std::error_code no_directory;
  const std::filesystem::path directory = pattern.has_parent_path() ? pattern.parent_path() : ".";
  for (const auto& entry : std::filesystem::directory_iterator(directory, no_directory)) {
    const long long number =
        frame_number(entry.path().filename().string(), name.substr(0, begin), end - begin, name.substr(end));
    if (number >= 0) found.emplace(number, entry.path());
  }
  if (found.empty()) fail("no file of this pattern", "each # stands for a digit of the frame number");
  std::vector<std::filesystem::path> files;
  for (const auto& [number, file] : found) {
    const long long expected = found.begin()->first + static_cast<long long>(files.size());
    if (number != expected)
      fail(fmt::format("the sequence has a gap: frame {} is missing", expected),
           fmt::format("it runs from {} to {}", found.begin()->first, found.rbegin()->first));
    files.push_back(file);
  }
  return files;
}

std::vector<Vec3> rest_vertices(const Rig& rig) {
  std::vector<Vec3> vertices(rig.vertices.size());
  sample_rig(rig, {}, Affine::Identity(), vertices);
  return vertices;
}

std::vector<Eigen::Vector3f> pick(const std::vector<Vec3>& vertices,
                                  const std::vector<std::int32_t>& chosen) {
  std::vector<Eigen::Vector3f> result;
  result.reserve(chosen.size());
  for (const std::int32_t v : chosen) result.push_back(vertices[static_cast<std::size_t>(v)].cast<float>());
  return result;
}

// Gives the frames read so far a vertex for each of the finer weld.
void split(std::vector<std::vector<Eigen::Vector3f>>& frames, const std::vector<std::int32_t>& parents) {
  for (auto& frame : frames) {
    if (frame.size() == parents.size()) continue;
    std::vector<Eigen::Vector3f> finer;
    finer.reserve(parents.size());
    for (const std::int32_t parent : parents) finer.push_back(frame[static_cast<std::size_t>(parent)]);
    frame = std::move(finer);
  }
}

}  // namespace

bool is_sequence(const std::filesystem::path& file) {
  return file.filename().string().find('#') != std::string::npos;
}

Sequence read_sequence(const std::filesystem::path& pattern) {
  Sequence sequence;
  Weld weld;
  Rig first;
  for (const std::filesystem::path& file : files_of(pattern)) {
    ImportedMesh mesh = import_mesh(file, {});
    const std::vector<Vec3> vertices = rest_vertices(mesh.rig);
    if (sequence.frames.empty()) {
      sequence.declared = mesh.declared;
      weld = find_weld(mesh.rig);
      first = std::move(mesh.rig);
    } else {
      if (mesh.rig.triangles != first.triangles || vertices.size() != first.vertices.size())
        throw Error(ErrorKind::kInput, file.string(),
                    "its triangles are not those of the sequence's first file",
                    "a sequence moves the vertices of one surface");
      split(sequence.frames, refine(weld, vertices));
    }
    sequence.frames.push_back(pick(vertices, weld.representative));
  }
  sequence.rig = apply(std::move(first), weld);
  return sequence;
}

void sample_sequence(const Sequence& sequence, double position, bool loop, const Affine& placement,
                     std::span<Vec3> out) {
  const std::size_t count = sequence.frames.size();
  const double held = loop ? std::fmod(position, static_cast<double>(count))
                           : std::min(position, static_cast<double>(count - 1));
  const auto before = static_cast<std::size_t>(held);
  const std::size_t after = loop ? (before + 1) % count : std::min(before + 1, count - 1);
  const double weight = held - static_cast<double>(before);
  for (std::size_t v = 0; v < out.size(); ++v) {
    const Vec3 a = sequence.frames[before][v].cast<double>(), b = sequence.frames[after][v].cast<double>();
    out[v] = placement * Vec3(a + weight * (b - a));
  }
}

}  // namespace ringlet::solids
