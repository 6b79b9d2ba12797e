// Log lines for people: to stderr, `info: ...` or `warning: ...`. Choices made for the user are logged here.
#pragma once
#include <string>

namespace ringlet {

enum class LogLevel { kQuiet, kWarning, kInfo, kDebug };

void set_log_level(LogLevel level);
void log_debug(const std::string& message);
void log_info(const std::string& message);
void log_warning(const std::string& message);
// The same words only once in a process: a study takes the same run several times.
void log_warning_once(const std::string& message);

}  // namespace ringlet
