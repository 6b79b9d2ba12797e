// Typed errors. The library throws them; only apps/ prints and exits.
#pragma once
#include <stdexcept>
#include <string>
#include <vector>

namespace ringlet {

// What went wrong, as the program's exit code (see the README).
enum class ErrorKind { kUsage = 2, kInput = 3, kDiverged = 4, kIo = 5, kDevice = 6 };

// One line of `error: WHERE: WHAT (HINT)`.
struct Problem {
  std::string where;  // a file with line and column, or a file with a JSON pointer; may be empty
  std::string what;   // what was found and what was expected
  std::string hint;   // how to mend it; may be empty
};

// One or more problems found together; all of a scene's problems are reported at once.
class Error : public std::runtime_error {
 public:
  Error(ErrorKind kind, std::vector<Problem> problems);
  Error(ErrorKind kind, std::string where, std::string what, std::string hint = {});

  ErrorKind kind() const { return kind_; }
  const std::vector<Problem>& problems() const { return problems_; }

 private:
  ErrorKind kind_;
  std::vector<Problem> problems_;
};

// `WHERE: WHAT (HINT)`.
std::string to_string(const Problem& problem);

}  // namespace ringlet
