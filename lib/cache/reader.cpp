#include "cache/reader.h"

#include <algorithm>

#include "cache/layout.h"
#include "core/error.h"

namespace ringlet::cache {
namespace fs = std::filesystem;
namespace {

bool is_master(const fs::path& file) {
  if (!h5::is_hdf5(file)) return false;
  try {
    return content_of(file) == Content::kMaster;
  } catch (const Error&) {
    return file.stem()
        .extension()
        .empty();  // a damaged one is found by its name, and reported when it is opened
  }
}

fs::path find_master(const fs::path& directory) {
  std::vector<fs::path> masters;
  std::error_code error;
  for (fs::directory_iterator entry(directory, error), end; !error && entry != end; entry.increment(error)) {
    const fs::path& file = entry->path();
    if (file.extension() == ".h5" && is_master(file)) masters.push_back(file);
  }
  if (error) throw Error(ErrorKind::kInput, directory.string(), "cannot be listed: " + error.message());
  if (masters.empty()) throw Error(ErrorKind::kInput, directory.string(), "holds no Ringlet cache");
  if (masters.size() == 1) return masters[0];
  std::sort(masters.begin(), masters.end());
  throw Error(ErrorKind::kInput, directory.string(), "holds " + std::to_string(masters.size()) + " caches",
              "give one of them: " + masters[0].string());
}

h5::File open_as(const fs::path& file, Content content) {
  h5::File root(file);
  const Content found = check_identity(root);
  if (found != content)
    root.fail(std::string("is a ") + to_string(found) + " file of a cache, expected a " + to_string(content) +
              " file");
  return root;
}

}  // namespace

CacheReader::CacheReader(const fs::path& path) : file_(fs::is_directory(path) ? find_master(path) : path) {
  const h5::File root(file_);
  const Content content = check_identity(root);
  if (content != Content::kMaster && content != Content::kFailed)
    root.fail(std::string("is the ") + to_string(content) + " file of a cache, not a cache");
  header_ = read_header(root);
  if (content == Content::kFailed) {
    failure_ = read_failure(root);
    frames_ = root.read<std::int32_t>("frames", {1});
    return;
  }
  const Storage storage = read_storage(root);
  compression_ = storage.compression;
  error_bound_ = storage.error;
  frame_files_ = Files{file_.parent_path(), file_.stem().string()}.frames();
  for (const auto& [number, file] : frame_files_) frames_.push_back(number);
}

state::Frame CacheReader::read(int frame) const {
  if (failure_ && frames_[0] == frame) return read_single(h5::File(file_), header_);
  const auto found = frame_files_.find(frame);
  if (found == frame_files_.end())
    throw Error(ErrorKind::kInput, file_.string(), "has no frame " + std::to_string(frame));
  const h5::File root = open_as(found->second, Content::kFrame);
  state::Frame read = read_frame(root, &header_);
  if (read.number != frame)
    root.fail("holds frame " + std::to_string(read.number) + ", which is not what its name says");
  return read;
}

std::string format_of(const fs::path& file) {
  if (!h5::is_hdf5(file)) return {};
  const h5::File root(file);
  return root.has_attribute("format") ? root.text("format") : std::string();
}

std::optional<Content> content_of(const fs::path& file) {
  if (format_of(file) != kFormat) return {};
  return check_identity(h5::File(file));
}

state::Frame read_frame_file(const fs::path& file) {
  return read_frame(open_as(file, Content::kFrame), nullptr);
}

state::Snapshot read_state_file(const fs::path& file) {
  return read_snapshot(open_as(file, Content::kState));
}

}  // namespace ringlet::cache
