#include "cache/files.h"

#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <charconv>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <system_error>
#include <vector>

#include "core/error.h"

namespace ringlet::cache {
namespace fs = std::filesystem;
namespace {

constexpr const char* kAside = ".tmp";

std::string hint_for(int error) {
  switch (error) {
    case ENOSPC:
    case EDQUOT:
      return "make room and go on with --resume";
    case EACCES:
    case EPERM:
    case EROFS:
      return "choose another directory with -o";
    default:
      return {};
  }
}

Error io_error(const fs::path& path, const std::string& what, int error) {
  return {ErrorKind::kIo, path.string(), what + ": " + std::generic_category().message(error),
          hint_for(error)};
}

fs::path aside(const fs::path& path) {
  std::string name = ".";
  name += path.filename().string();
  return path.parent_path() / (name + kAside);
}

// A file being written aside. Unless `publish` succeeds it is removed.
class FileAside {
 public:
  explicit FileAside(const fs::path& path) : path_(path), aside_(aside(path)) {
    descriptor_ = ::open(aside_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
    if (descriptor_ < 0) throw io_error(path_, "cannot be written", errno);
  }
  ~FileAside() {
    if (descriptor_ >= 0) ::close(descriptor_);
    if (!published_) ::unlink(aside_.c_str());
  }
  FileAside(const FileAside&) = delete;
  FileAside& operator=(const FileAside&) = delete;

  void write(std::span<const std::byte> bytes) {
    while (!bytes.empty()) {
      const ssize_t written = ::write(descriptor_, bytes.data(), bytes.size());
      if (written < 0 && errno == EINTR) continue;
      if (written < 0) throw io_error(path_, "cannot be written", errno);
      bytes = bytes.subspan(static_cast<std::size_t>(written));
    }
  }

  void publish() {
    if (::fsync(descriptor_) != 0) throw io_error(path_, "cannot be flushed", errno);
    const int closed = ::close(descriptor_);
    descriptor_ = -1;
    if (closed != 0) throw io_error(path_, "cannot be closed", errno);
    if (::rename(aside_.c_str(), path_.c_str()) != 0) throw io_error(path_, "cannot be put in place", errno);
    published_ = true;
  }

 private:
  fs::path path_, aside_;
  int descriptor_ = -1;
  bool published_ = false;
};

bool is_there(const fs::path& path) {
  std::error_code error;
  return fs::exists(path, error);
}

void remove_file(const fs::path& path) {
  std::error_code error;
  if (!fs::remove(path, error) && error) throw io_error(path, "cannot be removed", error.value());
}

}  // namespace

std::string Files::frame_name(int number) const {
  char digits[16];
  std::snprintf(digits, sizeof digits, number < 0 ? "-%04lld" : "%04lld",
                std::abs(static_cast<long long>(number)));
  return name + "." + digits + ".h5";
}

std::optional<int> Files::frame_number(const std::string& file) const {
  if (!file.starts_with(name + ".") || !file.ends_with(".h5") || file.size() < name.size() + 4) return {};
  const char* first = file.data() + name.size() + 1;
  const char* last = file.data() + file.size() - 3;
  int number = 0;
  const auto [end, error] = std::from_chars(first, last, number);
  if (error != std::errc{} || end != last || frame_name(number) != file) return {};
  return number;
}

std::map<int, fs::path> Files::frames() const {
  std::map<int, fs::path> found;
  std::error_code error;
  for (fs::directory_iterator entry(directory, error), end; !error && entry != end; entry.increment(error)) {
    if (const auto number = frame_number(entry->path().filename().string())) found[*number] = entry->path();
  }
  return found;
}

bool Files::exist() const { return is_there(master()) || is_there(state()) || !frames().empty(); }

void Files::remove_all() const {
  remove_file(master());  // first: without it the rest is no cache
  for (const auto& [number, path] : frames()) remove_file(path);
  for (const fs::path& path : {state(), timings()}) remove_file(path);
  remove_leftovers();
}

void Files::remove_leftovers() const {
  remove_file(failed());
  for (const fs::path& path : {master(), state(), failed()}) remove_file(aside(path));
  std::vector<fs::path> leftovers;
  std::error_code error;
  for (fs::directory_iterator entry(directory, error), end; !error && entry != end; entry.increment(error)) {
    const std::string file = entry->path().filename().string();
    if (!file.starts_with('.') || !file.ends_with(kAside)) continue;
    if (frame_number(file.substr(1, file.size() - 1 - std::strlen(kAside))))
      leftovers.push_back(entry->path());
  }
  for (const fs::path& path : leftovers) remove_file(path);
}

void write_atomically(const fs::path& path, std::span<const std::byte> bytes) {
  FileAside file(path);
  file.write(bytes);
  file.publish();
}

void append_line(const fs::path& path, const std::string& line) {
  std::FILE* file = std::fopen(path.c_str(), "ae");
  if (!file) throw io_error(path, "cannot be written", errno);
  const bool written = std::fputs((line + "\n").c_str(), file) >= 0;
  const int error = errno;
  if (std::fclose(file) != 0 || !written) throw io_error(path, "cannot be written", written ? errno : error);
}

void make_directory(const fs::path& directory) {
  std::error_code error;
  fs::create_directories(directory, error);
  if (error) throw io_error(directory, "the directory cannot be made", error.value());
}

}  // namespace ringlet::cache
