#include "progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "core/timer.h"

namespace ringlet::app {
namespace {

std::string clock_text(double seconds) {
  const long s = static_cast<long>(seconds + 0.5);
  return fmt::format("{:02}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60);
}

class Quiet : public Progress {
  void frame(int, int, int, double, const pipeline::StageSeconds&) override {}
};

// Time left, from the mean of the frames so far.
class Timed : public Progress {
 protected:
  double left(int done, int total) const { return timer_.seconds() / done * (total - done); }

 private:
  Timer timer_;
};

class Plain : public Timed {
 public:
  explicit Plain(int last) : last_(last) {}
  void frame(int frame, int done, int total, double seconds, const pipeline::StageSeconds&) override {
    fmt::print("frame {}/{} {:.1f}% {:.0f} ms/frame eta {}\n", frame, last_, 100.0 * done / total,
               1e3 * seconds, clock_text(left(done, total)));
    std::fflush(stdout);
  }

 private:
  int last_;
};

class Bar : public Timed {
 public:
  explicit Bar(int last) : last_(last) {}
  void frame(int frame, int done, int total, double seconds, const pipeline::StageSeconds&) override {
    constexpr int kWidth = 30;
    const int filled = kWidth * done / total;
    fmt::print("\r[{:=<{}}{: <{}}] frame {}/{} {:.0f} ms/frame eta {} ", "", filled, "", kWidth - filled,
               frame, last_, 1e3 * seconds, clock_text(left(done, total)));
    std::fflush(stdout);
  }
  void end() override { fmt::print("\n"); }

 private:
  int last_;
};

class JsonLines : public Timed {
  void frame(int frame, int done, int total, double seconds, const pipeline::StageSeconds& stages) override {
    nlohmann::ordered_json line = {{"frame", frame},
                                   {"done", done},
                                   {"total", total},
                                   {"seconds", seconds},
                                   {"eta_seconds", left(done, total)}};
    for (const auto& [stage, spent] : stages) line["stages"][stage] = spent;
    fmt::print("{}\n", line.dump());
    std::fflush(stdout);
  }
};

}  // namespace

std::unique_ptr<Progress> make_progress(const std::string& kind, int last_frame) {
  if (kind == "none") return std::make_unique<Quiet>();
  if (kind == "json") return std::make_unique<JsonLines>();
  if (kind == "bar" || (kind == "auto" && isatty(STDOUT_FILENO))) return std::make_unique<Bar>(last_frame);
  return std::make_unique<Plain>(last_frame);
}

}  // namespace ringlet::app
