// Where a run's time goes, for chrome://tracing and Perfetto: a file in the Trace Event Format (JSON), one
// event a span of work, on the thread that did it. While nothing is recorded a span costs the reading of a
// flag.
#pragma once
#include <atomic>
#include <filesystem>
#include <initializer_list>
#include <string>
#include <string_view>
#include <utility>

namespace ringlet::trace {

namespace internal {
extern std::atomic<bool> recording;
}

inline bool on() { return internal::recording.load(std::memory_order_relaxed); }

// Throws what a trace cannot be recorded into the file for, and leaves the file as it is: Error{kUsage} for
// one that is there and holds something else than a trace of this program, Error{kIo} where none can be
// written.
void check_destination(const std::filesystem::path& file);

// Records while it lives; one at a time. What is recorded stays in memory until `open` gives it a file.
// Whatever becomes of the program from then on, the file is whole JSON as of the last `flush`.
class Recording {
 public:
  Recording();
  ~Recording();
  Recording(const Recording&) = delete;
  Recording& operator=(const Recording&) = delete;
  void open(const std::filesystem::path& file);  // replaces the file; throws Error{kIo}
  void finish();                                 // throws Error{kIo} where not all of it could be written
};

// From its construction to its destruction, `category` being what viewers filter by.
class Span {
 public:
  explicit Span(std::string_view name, const char* category = "run") {
    if (on()) begin(name, category);
  }
  ~Span() {
    if (begun_) end();
  }
  Span(const Span&) = delete;
  Span& operator=(const Span&) = delete;

  // What viewers show beside it. Nothing where nothing is recorded.
  void tell(std::string_view key, double value);
  void tell(std::string_view key, std::string_view value);
  bool recorded() const { return begun_; }

 private:
  void begin(std::string_view name, const char* category);
  void end();

  bool begun_ = false;
  double start_ = 0;  // [us] since the recording began
  const char* category_ = nullptr;
  std::string name_, arguments_;
};

// Values that viewers draw as curves over time.
void count(std::string_view name, std::initializer_list<std::pair<std::string_view, double>> values);

// Names the calling thread.
void name_thread(std::string_view name);

// Brings what was recorded so far into the file, where there is one.
void flush();

}  // namespace ringlet::trace
