#include "core/json_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

namespace ringlet {
namespace {

constexpr std::size_t kDeepest =
    64;  // levels; a scene needs ten, a hair mesh three, and recursion over a value must end
constexpr std::size_t kBrief = 60;  // characters

// `LINE:COLUMN` (from 1, in bytes) of the last of the `read` characters that the parser has consumed.
std::string line_and_column(std::string_view text, std::size_t read) {
  const std::string_view before = text.substr(0, std::min(read == 0 ? 0 : read - 1, text.size()));
  const auto line = 1 + std::count(before.begin(), before.end(), '\n');
  const std::size_t line_start = before.rfind('\n') + 1;  // npos + 1 is 0
  return fmt::format("{}:{}", line, before.size() - line_start + 1);
}

// The library's message without its exception id and without the position, which we give in our own form.
std::string without_prefix(std::string message) {
  message.erase(0, message.find("] ") + 2);
  if (message.starts_with("parse error")) message.erase(0, message.find(": ") + 2);
  return message;
}

// Builds the value from the parser's events. The library's own builder lets the last of two equal keys win
// and its parser throws away the position of a number that is too large; both matter to somebody who edits a
// file by hand.
class Builder : public nlohmann::json_sax<Json> {
 public:
  Builder(std::string_view text, std::string name) : text_(text), name_(std::move(name)) {}

  Json result() {
    if (!problems_.empty()) throw Error(ErrorKind::kInput, std::move(problems_));
    return std::move(root_);
  }

  bool null() override { return put(nullptr), true; }
  bool boolean(bool value) override { return put(value), true; }
  bool number_integer(number_integer_t value) override { return put(value), true; }
  bool number_unsigned(number_unsigned_t value) override {
    constexpr auto kLargest = std::numeric_limits<number_integer_t>::max();
    if (value > static_cast<number_unsigned_t>(kLargest)) return put(static_cast<double>(value)), true;
    return put(static_cast<number_integer_t>(value)),
           true;  // one integer type, so that equal values compare equal
  }
  bool number_float(number_float_t value, const string_t&) override { return put(value), true; }
  bool string(string_t& value) override { return put(std::move(value)), true; }
  bool binary(binary_t&) override { return false; }  // never occurs in text

  bool start_object(std::size_t) override { return open(Json::object()); }
  bool start_array(std::size_t) override { return open(Json::array()); }
  bool end_object() override { return close(); }
  bool end_array() override { return close(); }

  bool key(string_t& key) override {
    Level& level = levels_.back();
    level.key = std::move(key);
    if (level.value->contains(level.key))
      problems_.push_back({name_ + "#" + pointer() + pointer_token(level.key), "the key is given twice", ""});
    return true;
  }

  bool parse_error(std::size_t position, const std::string&,
                   const nlohmann::detail::exception& error) override {
    problems_.push_back({name_ + ":" + line_and_column(text_, position), without_prefix(error.what()), ""});
    return false;
  }

 private:
  struct Level {
    Json* value;      // an open object or list; its parents do not change while it is open
    std::string key;  // the member being read, in an object
  };

  Json* put(Json value) {
    if (levels_.empty()) return &(root_ = std::move(value));
    Json& parent = *levels_.back().value;
    if (parent.is_object()) return &(parent[levels_.back().key] = std::move(value));
    parent.push_back(std::move(value));
    return &parent.back();
  }

  bool open(Json value) {
    if (levels_.size() == kDeepest) {
      problems_.push_back(
          {name_ + "#" + pointer(), fmt::format("nested deeper than {} levels", kDeepest), ""});
      return false;
    }
    levels_.push_back({put(std::move(value)), {}});
    return true;
  }

  bool close() { return levels_.pop_back(), true; }

  // Pointer of the innermost open value.
  std::string pointer() const {
    std::string text;
    for (std::size_t i = 0; i + 1 < levels_.size(); ++i) {
      const Level& level = levels_[i];
      text += level.value->is_object() ? pointer_token(level.key) : pointer_token(level.value->size() - 1);
    }
    return text;
  }

  std::string_view text_;
  std::string name_;
  Json root_;
  std::vector<Level> levels_;
  std::vector<Problem> problems_;
};

}  // namespace

Json parse_json(std::string_view text, const std::string& name) {
  Builder builder(text, name);
  Json::sax_parse(text.begin(), text.end(), &builder);
  return builder.result();
}

std::string brief(const Json& value) {
  std::string text = value.dump(-1, ' ', false, Json::error_handler_t::replace);
  if (text.size() <= kBrief) return text;
  std::size_t end = kBrief - 3;
  while (end > 0 && (text[end] & 0xC0) == 0x80) --end;  // not within a UTF-8 sequence
  return text.substr(0, end) + "...";
}

std::string pointer_token(std::string_view token) {
  std::string text = "/";
  for (const char c : token) {
    if (c == '~')
      text += "~0";
    else if (c == '/')
      text += "~1";
    else
      text += c;
  }
  return text;
}

std::string pointer_token(std::size_t index) { return "/" + std::to_string(index); }

}  // namespace ringlet
