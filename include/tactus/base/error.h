#pragma once
/// Errors: one message that names the thing, its value and the values allowed.
#include <cstdint>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace tactus {

/// Kinds of error by exit code: `usage` ends the program with 2, `failure` with 1.
enum class ErrorKind : std::uint8_t { usage, failure };

/// Thrown by every public function that is handed something it can't use. Nothing was changed or written.
class Error : public std::runtime_error {
 public:
  explicit Error(const std::string& message, ErrorKind kind = ErrorKind::failure)
      : std::runtime_error(message), kind_(kind) {}
  ErrorKind kind() const { return kind_; }

 private:
  ErrorKind kind_;
};

/// An error in the user's request (flag, scene key, figure name): exit code 2.
inline Error usage_error(const std::string& message) { return Error(message, ErrorKind::usage); }

/// The known spelling nearest to `word` (Damerau-Levenshtein), or "" when none is within a third of its
/// length.
std::string nearest_spelling(std::string_view word, std::span<const std::string> known);

/// "; did you mean 'x'?" or, where nothing is near, "; known: a, b, c".
std::string suggestion(std::string_view word, std::span<const std::string> known);

/// "0.001", "2.5e+06", "nan": for messages.
std::string number_text(double x);

/// "3.4 GB", "512 B": for messages.
std::string bytes_text(double bytes);

}  // namespace tactus
