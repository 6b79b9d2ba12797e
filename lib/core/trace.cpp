#include "core/trace.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cmath>
#include <fstream>
#include <mutex>
#include <nlohmann/json.hpp>
#include <system_error>

#include "core/error.h"
#include "core/log.h"
#include "core/timer.h"

namespace ringlet::trace {

namespace internal {
std::atomic<bool> recording = false;
}

namespace {

constexpr std::string_view kHead = "{\"displayTimeUnit\": \"ms\", \"traceEvents\": [\n", kTail = "\n]}\n";
constexpr std::size_t kMostPending = 1 << 16;

// What is recorded, and where to. Events are written over the tail, with a tail of their own.
struct Recorder {
  std::mutex mutex;
  Timer clock;
  std::filesystem::path path;
  int file = -1;
  off_t length = 0;  // of the file, without its tail
  bool first = true;
  int error = 0;  // errno of the first write that failed
  std::string pending;

  double now() const { return 1e6 * clock.seconds(); }

  void add(const std::string& event) {
    const std::lock_guard lock(mutex);
    if (!on()) return;
    pending += first ? "" : ",\n";
    pending += event;
    first = false;
    if (file >= 0 && pending.size() > kMostPending) write_pending();
  }

  void write_pending() {
    const std::string text = pending + std::string(kTail);
    for (std::size_t done = 0; done < text.size() && error == 0;) {
      const ssize_t count =
          ::pwrite(file, text.data() + done, text.size() - done, length + static_cast<off_t>(done));
      if (count < 0 && errno != EINTR) error = errno;
      if (count > 0) done += static_cast<std::size_t>(count);
    }
    length += static_cast<off_t>(pending.size());
    pending.clear();
  }
};

Recorder& recorder() {
  static Recorder instance;
  return instance;
}

int thread_number() {
  static std::atomic<int> next = 1;
  thread_local const int number = next++;
  return number;
}

std::string quoted(std::string_view text) { return nlohmann::json(text).dump(); }
std::string number(double value) { return std::isfinite(value) ? fmt::format("{}", value) : "null"; }

std::string event(char phase, std::string_view name, double time, const std::string& more) {
  return fmt::format(R"({{"ph": "{}", "name": {}, "pid": 1, "tid": {}, "ts": {:.3f}{}}})", phase,
                     quoted(name), thread_number(), time, more);
}

[[noreturn]] void refuse_to_write(const std::filesystem::path& path, int error) {
  throw Error(ErrorKind::kIo, path.string(), "cannot be written: " + std::generic_category().message(error),
              "choose another file with --trace");
}

}  // namespace

void check_destination(const std::filesystem::path& path) {
  namespace fs = std::filesystem;
  std::error_code error;
  const bool there = fs::exists(path, error);
  if (fs::is_directory(path, error)) refuse_to_write(path, EISDIR);
  const fs::path parent = path.has_parent_path() ? path.parent_path() : fs::path(".");
  if (::access((there ? path : parent).c_str(), W_OK) != 0) refuse_to_write(path, errno);
  if (!there || !fs::is_regular_file(path, error) || fs::file_size(path, error) == 0) return;
  std::ifstream stream(path, std::ios::binary);
  std::string head(kHead.size(), '\0');
  stream.read(head.data(), static_cast<std::streamsize>(head.size()));
  if (!stream || head != kHead)
    throw Error(ErrorKind::kUsage, path.string(), "is there and is no trace of this program",
                "choose another file with --trace, or remove this one");
}

Recording::Recording() {
  Recorder& to = recorder();
  const std::lock_guard lock(to.mutex);
  to.clock = Timer(), to.length = 0, to.first = true, to.error = 0;
  to.pending = kHead;
  internal::recording = true;
}

void Recording::open(const std::filesystem::path& path) {
  Recorder& to = recorder();
  const std::lock_guard lock(to.mutex);
  to.path = path;
  to.file = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (to.file < 0) refuse_to_write(path, errno);
  to.write_pending();
}

Recording::~Recording() {
  try {
    finish();
  } catch (const Error& failure) {
    log_warning(failure.what());
  }
}

void Recording::finish() {
  Recorder& to = recorder();
  const std::lock_guard lock(to.mutex);
  internal::recording = false;
  if (to.file < 0) return to.pending.clear();
  to.write_pending();
  if (::close(std::exchange(to.file, -1)) != 0 && to.error == 0) to.error = errno;
  if (to.error != 0)
    throw Error(ErrorKind::kIo, to.path.string(),
                "the trace cannot be written: " + std::generic_category().message(to.error));
}

void Span::begin(std::string_view name, const char* category) {
  begun_ = true, name_ = name, category_ = category;
  start_ = recorder().now();
}

void Span::end() {
  recorder().add(event('X', name_, start_,
                       fmt::format(R"(, "dur": {:.3f}, "cat": "{}", "args": {{{}}})",
                                   recorder().now() - start_, category_, arguments_)));
}

void Span::tell(std::string_view key, double value) {
  if (begun_)
    arguments_ += fmt::format("{}{}: {}", arguments_.empty() ? "" : ", ", quoted(key), number(value));
}
void Span::tell(std::string_view key, std::string_view value) {
  if (begun_)
    arguments_ += fmt::format("{}{}: {}", arguments_.empty() ? "" : ", ", quoted(key), quoted(value));
}

void count(std::string_view name, std::initializer_list<std::pair<std::string_view, double>> values) {
  if (!on()) return;
  std::string series;
  for (const auto& [key, value] : values)
    series += fmt::format("{}{}: {}", series.empty() ? "" : ", ", quoted(key), number(value));
  recorder().add(event('C', name, recorder().now(), fmt::format(R"(, "args": {{{}}})", series)));
}

void name_thread(std::string_view name) {
  if (!on()) return;
  recorder().add(event('M', "thread_name", 0, fmt::format(R"(, "args": {{"name": {}}})", quoted(name))));
}

void flush() {
  if (!on()) return;
  Recorder& to = recorder();
  const std::lock_guard lock(to.mutex);
  if (to.file >= 0) to.write_pending();
}

}  // namespace ringlet::trace
