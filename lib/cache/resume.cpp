#include "cache/resume.h"

#include "cache/json_difference.h"
#include "core/error.h"
#include "core/log.h"

namespace ringlet::cache {
namespace {

void refuse(const Files& files, const std::string& what) {
  throw Error(ErrorKind::kUsage, files.master().string(), "cannot be resumed: " + what,
              "--overwrite starts anew, -o writes elsewhere");
}

void check_scene(const Files& files, const state::RunHeader& before, const state::RunHeader& now) {
  for (const Difference& difference : json_differences(before.scene_json, now.scene_json)) {
    if (difference.where == "/frames/last") continue;  // a run may be prolonged
    const auto value = [](const std::string& text) { return text.empty() ? "absent" : text; };
    refuse(files, "the scene's " + difference.where + " was " + value(difference.a) + " and is " +
                      value(difference.b));
  }
}

void check_header(const Files& files, const state::RunHeader& before, const state::RunHeader& now) {
  check_scene(files, before, now);
  if (before.backend != now.backend)
    refuse(files, "its backend was " + before.backend + ", now " + now.backend);
  // Instruction sets with fused multiply-add give the same bits; generic gives others.
  if ((before.instruction_set == "generic") != (now.instruction_set == "generic"))
    refuse(files, "its instruction set was " + before.instruction_set + ", now " + now.instruction_set);
  if (before.precision != now.precision)
    refuse(files, "its precision was " + before.precision + ", now " + now.precision);
  if (hash_of(before) != hash_of(now))
    refuse(files, "the strands are not the same: a groom or mesh file has changed");
  if (before.program_version != now.program_version) {
    log_warning(files.master().string() + " was begun by version " + before.program_version +
                ", going on with " + now.program_version);
  }
}

std::map<int, FrameRecord> read_records(const Files& files) {
  std::map<int, FrameRecord> records;
  for (const auto& [number, path] : files.frames()) {
    try {
      const h5::File root(path);
      if (check_identity(root) == Content::kFrame) records[number] = read_record(root);
    } catch (const Error& error) {
      log_warning(std::string(error.what()) + "; the frame is computed again");
    }
  }
  return records;
}

std::optional<state::Snapshot> read_state(const Files& files, const state::RunHeader& header) {
  std::error_code error;
  if (!std::filesystem::exists(files.state(), error)) return {};
  try {
    const h5::File root(files.state());
    if (check_identity(root) != Content::kState) root.fail("is not a state");
    if (root.number<std::int64_t>("header_hash") != static_cast<std::int64_t>(hash_of(header)))
      root.fail("is the state of another run");
    return read_snapshot(root);
  } catch (const Error& failure) {
    log_warning(std::string(failure.what()) + "; starting from the first frame");
    return {};
  }
}

}  // namespace

Remains find_remains(const Files& files, const state::RunHeader& header) {
  if (!files.exist()) return {};
  std::error_code error;
  if (!std::filesystem::exists(files.master(), error))
    refuse(files, "there are frames or a state, but no master");
  {
    const h5::File root(files.master());
    if (check_identity(root) != Content::kMaster) refuse(files, "it is not a cache");
    check_header(files, read_header(root), header);
  }
  Remains remains{read_records(files), read_state(files, header)};
  if (!remains.snapshot) return remains;
  for (int frame = header.first_frame; frame <= remains.snapshot->frame; ++frame) {
    if (remains.frames.contains(frame)) continue;
    log_warning(files.frame(frame).string() + " is missing; starting from the first frame");
    remains.snapshot.reset();
    break;
  }
  return remains;
}

}  // namespace ringlet::cache
