#include "core/log.h"

#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <mutex>
#include <set>

namespace ringlet {
namespace {
spdlog::logger& logger() {
  static spdlog::logger instance = [] {
    spdlog::logger made("ringlet", std::make_shared<spdlog::sinks::stderr_sink_mt>());
    made.set_pattern("%l: %v");
    return made;
  }();
  return instance;
}
}  // namespace

void set_log_level(LogLevel level) {
  switch (level) {
    case LogLevel::kQuiet:
      return logger().set_level(spdlog::level::err);
    case LogLevel::kWarning:
      return logger().set_level(spdlog::level::warn);
    case LogLevel::kInfo:
      return logger().set_level(spdlog::level::info);
    case LogLevel::kDebug:
      return logger().set_level(spdlog::level::debug);
  }
}
void log_debug(const std::string& message) { logger().debug("{}", message); }
void log_info(const std::string& message) { logger().info("{}", message); }
void log_warning(const std::string& message) { logger().warn("{}", message); }
void log_warning_once(const std::string& message) {
  static std::mutex mutex;
  static std::set<std::string> given;
  const std::lock_guard lock(mutex);
  if (given.insert(message).second) log_warning(message);
}

}  // namespace ringlet
