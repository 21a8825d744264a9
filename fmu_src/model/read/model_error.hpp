#pragma once

#include <stdexcept>
#include <string>
#include <vector>

namespace redysim {

// One finding about a model file. text() is "file:line:column: message"; line 0: no place in the file.
struct Diagnostic {
  std::string file;
  int line = 0, column = 0;
  std::string message;
  std::string text() const;
};

// The only exception thrown by loading. Contains every error found in the file, in file order.
class ModelError : public std::runtime_error {
 public:
  enum class Reason { unreadable, syntax, invalid };
  ModelError(Reason reason, std::vector<Diagnostic> diagnostics);
  Reason reason() const { return reason_; }
  const std::vector<Diagnostic>& diagnostics() const { return diagnostics_; }

 private:
  Reason reason_;
  std::vector<Diagnostic> diagnostics_;
};

}  // namespace redysim
