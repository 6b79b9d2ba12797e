#include "study/plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

namespace ringlet::study {
namespace {

constexpr double kWidth = 900, kHeight = 600;
constexpr double kLeft = 86, kRight = 24, kTop = 74, kBottom = 64;  // margins of the axes
constexpr double kFont = 12, kCharacter = 7.2;                      // a character's mean width at that size
constexpr std::array kColours = {"#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"};
constexpr const char* kGiven = "#222222";  // the scene as given

struct Box {
  double left, top, right, bottom;

  bool meets(const Box& other) const {
    return left < other.right && other.left < right && top < other.bottom && other.top < bottom;
  }
};

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text)
    out += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
  return out;
}

// One axis, logarithmic.
class Scale {
 public:
  Scale(double low, double high, double from, double to) : from_(from), to_(to) {
    low_ = std::log10(low), high_ = std::log10(high);
    const double margin =
        std::max(0.06 * (high_ - low_), 0.5 * (0.7 - (high_ - low_)));  // 0.7 decades at least
    low_ -= margin, high_ += margin;
  }
  double operator()(double value) const {
    return from_ + (to_ - from_) * (std::log10(value) - low_) / (high_ - low_);
  }
  struct Tick {
    double value;
    bool labelled;
  };
  std::vector<Tick> ticks() const {
    std::vector<Tick> ticks;
    const double decades = high_ - low_;
    for (int decade = static_cast<int>(std::floor(low_)); decade <= high_; ++decade)
      for (int digit = 1; digit < 10; ++digit) {
        const double value = digit * std::pow(10.0, decade);
        if (std::log10(value) < low_ || std::log10(value) > high_) continue;
        const bool labelled = digit == 1 || (decades < 2.2 && (digit == 2 || digit == 5)) || decades < 0.8;
        if (digit == 1 || decades < 8) ticks.push_back({value, labelled});
      }
    return ticks;
  }

 private:
  double low_, high_, from_, to_;
};

// 0.05, 20, 3·10⁻⁵.
std::string tick_text(double value) {
  static const std::array kSuperscripts = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};
  if (value >= 0.00999 && value < 9.9e4) return fmt::format("{:.6g}", value);
  const int exponent = static_cast<int>(std::floor(std::log10(value) + 1e-9));
  const int digit = static_cast<int>(std::lround(value / std::pow(10.0, exponent)));
  std::string text = digit == 1 ? "10" : fmt::format("{}·10", digit);
  if (exponent < 0) text += "⁻";
  for (const char c : std::to_string(std::abs(exponent)))
    text += kSuperscripts[static_cast<std::size_t>(c - '0')];
  return text;
}

struct Mark {
  std::size_t row;
  double x, y;
  bool on_front;
};

class Picture {
 public:
  explicit Picture(const Study& study) : study_(study), answers_(answer(study)) {}

  std::string draw() {
    out_ = fmt::format(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0} {1}\" width=\"{0}\" height=\"{1}\" "
        "font-family=\"DejaVu Sans, Helvetica, Arial, sans-serif\" font-size=\"{2}\">\n"
        "<rect width=\"{0}\" height=\"{1}\" fill=\"white\"/>\n",
        kWidth, kHeight, kFont);
    text(kLeft, 24, "start", fmt::format("{}: what accuracy costs", study_.scene), 16);
    if (collect()) {
      frame();
      front();
      for (const Mark& mark : marks_) point(mark);
      labels();
    } else {
      text(kWidth / 2, kHeight / 2, "middle", "no run has both a time and an error", 14);
    }
    return out_ + "</svg>\n";
  }

 private:
  bool collect() {
    std::vector<std::size_t> rows;
    double least = 0, most = 0, small = 0, large = 0;
    for (std::size_t k = 0; k < study_.rows.size(); ++k) {
      const Row& row = study_.rows[k];
      const auto& error = row.measured.errors.position;
      if (!row.timed || !error || !(error->rms > 0) || !std::isfinite(error->rms)) continue;
      if (rows.empty()) least = most = row.timed->milliseconds, small = large = error->rms;
      least = std::min(least, row.timed->milliseconds), most = std::max(most, row.timed->milliseconds);
      small = std::min(small, error->rms), large = std::max(large, error->rms);
      rows.push_back(k);
    }
    if (rows.empty()) return false;
    x_.emplace(least, most, kLeft, kWidth - kRight);
    y_.emplace(small, large, kHeight - kBottom, kTop);
    for (const std::size_t k : rows) {
      const bool on_front =
          std::find(answers_.front.begin(), answers_.front.end(), k) != answers_.front.end();
      marks_.push_back({k, (*x_)(study_.rows[k].timed->milliseconds),
                        (*y_)(study_.rows[k].measured.errors.position->rms), on_front});
    }
    return true;
  }

  void text(double x, double y, const char* anchor, const std::string& what, double size = kFont,
            const std::string& more = {}) {
    out_ += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"{}\" font-size=\"{}\" {}>{}</text>\n",
                        x, y, anchor, size, more, escaped(what));
  }

  void line(double x1, double y1, double x2, double y2, const std::string& style) {
    out_ += fmt::format("<line x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\" {}/>\n", x1, y1, x2,
                        y2, style);
  }

  // Axes, decades, names, and which colour is which setting.
  void frame() {
    const double right = kWidth - kRight, bottom = kHeight - kBottom;
    const auto grid = [](const Scale::Tick& tick) {
      const bool decade = std::abs(std::log10(tick.value) - std::round(std::log10(tick.value))) < 1e-9;
      return fmt::format("stroke=\"{}\"", decade ? "#bbbbbb" : "#ececec");
    };
    for (const Scale::Tick& tick : x_->ticks()) {
      line((*x_)(tick.value), kTop, (*x_)(tick.value), bottom, grid(tick));
      if (tick.labelled) text((*x_)(tick.value), bottom + 18, "middle", tick_text(tick.value));
    }
    for (const Scale::Tick& tick : y_->ticks()) {
      line(kLeft, (*y_)(tick.value), right, (*y_)(tick.value), grid(tick));
      if (tick.labelled) text(kLeft - 8, (*y_)(tick.value) + 4, "end", tick_text(tick.value));
    }
    out_ +=
        fmt::format("<rect x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#444444\"/>\n",
                    kLeft, kTop, right - kLeft, bottom - kTop);
    text((kLeft + right) / 2, kHeight - 18, "middle", "time of a frame [ms]", 14);
    const double middle = (kTop + bottom) / 2;
    text(22, middle, "middle", fmt::format("error of positions, RMS [{}]", study_.length_unit), 14,
         fmt::format("transform=\"rotate(-90 22 {:.1f})\"", middle));
    legend();
  }

  const char* colour(const Row& row) const {
    if (study_.product) return kColours[0];
    return row.axis < 0 ? kGiven : kColours[static_cast<std::size_t>(row.axis) % kColours.size()];
  }

  void legend() {
    double x = kLeft, y = 44;
    const auto entry = [&](const char* fill, const char* stroke, const std::string& name) {
      const double width = 16 + kCharacter * static_cast<double>(name.size()) + 18;
      if (x + width > kWidth - kRight) x = kLeft, y += 18;
      circle(x + 6, y, 5, fill, stroke);
      text(x + 16, y + 4, "start", name);
      x += width;
    };
    if (!study_.product) {
      entry(kGiven, kGiven, kAsGiven);
      for (std::size_t a = 0; a < study_.names.size(); ++a)
        entry(kColours[a % kColours.size()], kColours[a % kColours.size()], study_.names[a]);
    }
    entry("#777777", "#777777", "Pareto front");
    entry("white", "#777777", "wastes time");
  }

  void front() {
    std::string points;
    const Mark* before = nullptr;
    for (const std::size_t row : answers_.front) {
      const auto mark =
          std::find_if(marks_.begin(), marks_.end(), [&](const Mark& one) { return one.row == row; });
      if (mark == marks_.end()) continue;
      points += fmt::format("{:.1f},{:.1f} ", mark->x, mark->y);
      if (before) keep_clear(*before, *mark);
      before = &*mark;
    }
    out_ += fmt::format("<polyline points=\"{}\" fill=\"none\" stroke=\"#777777\" stroke-width=\"1.6\"/>\n",
                        points);
  }

  // No label on the line between these.
  void keep_clear(const Mark& from, const Mark& to) {
    const int pieces = 1 + static_cast<int>(std::hypot(to.x - from.x, to.y - from.y) / 6);
    for (int k = 0; k <= pieces; ++k) {
      const double share = static_cast<double>(k) / pieces;
      const double x = from.x + share * (to.x - from.x), y = from.y + share * (to.y - from.y);
      taken_.push_back({x - 2, y - 2, x + 2, y + 2});
    }
  }

  void circle(double x, double y, double radius, const char* fill, const char* stroke) {
    out_ += fmt::format(
        "<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"{}\" fill=\"{}\" stroke=\"{}\" stroke-width=\"1.6\"/>\n", x,
        y, radius, fill, stroke);
  }

  void point(const Mark& mark) {
    const char* stroke = colour(study_.rows[mark.row]);
    circle(mark.x, mark.y, 5.5, mark.on_front ? stroke : "white", stroke);
    if (answers_.knee == mark.row) circle(mark.x, mark.y, 10, "none", kGiven);
    taken_.push_back({mark.x - 7, mark.y - 7, mark.x + 7, mark.y + 7});
  }

  // The front's points first; a label that finds no free place is left out, the report's table has the run.
  void labels() {
    std::stable_sort(marks_.begin(), marks_.end(),
                     [](const Mark& a, const Mark& b) { return a.on_front > b.on_front; });
    for (const Mark& mark : marks_) {
      std::string label = study_.rows[mark.row].label;
      if (label.size() > 40) label = label.substr(0, 37) + "...";
      if (answers_.knee == mark.row) label += " (knee)";
      place(mark, label);
    }
  }

  void place(const Mark& mark, const std::string& label) {
    const double width = kCharacter * static_cast<double>(label.size()) + 4, height = kFont + 3;
    for (const double distance : {11.0, 20.0, 34.0, 52.0})
      for (const double angle : {-0.25, 0.25, 0.0, 0.75, -0.75, 1.0, -0.5, 0.5}) {
        const double dx = std::cos(angle * M_PI) * distance, dy = std::sin(angle * M_PI) * distance;
        const double left = mark.x + dx - (std::abs(dx) < 1 ? width / 2 : dx < 0 ? width : 0);
        const double middle = mark.y + dy;
        const Box box{left, middle - height / 2, left + width, middle + height / 2};
        const bool inside = box.left > kLeft + 2 && box.right < kWidth - kRight - 2 && box.top > kTop + 2 &&
                            box.bottom < kHeight - kBottom - 2;
        const bool free =
            std::none_of(taken_.begin(), taken_.end(), [&](const Box& other) { return box.meets(other); });
        if (!inside || !free) continue;
        taken_.push_back(box);
        if (distance > 15)
          line(mark.x + 6 * std::cos(angle * M_PI), mark.y + 6 * std::sin(angle * M_PI), mark.x + dx, middle,
               "stroke=\"#999999\" stroke-width=\"0.8\"");
        text(left + 2, middle + 4, "start", label, kFont, "fill=\"#222222\"");
        return;
      }
  }

  const Study& study_;
  Answers answers_;
  std::optional<Scale> x_, y_;
  std::vector<Mark> marks_;
  std::vector<Box> taken_;
  std::string out_;
};

}  // namespace

std::string plot(const Study& study) { return Picture(study).draw(); }

}  // namespace ringlet::study
