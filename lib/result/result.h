#pragma once

#include <string>
#include <utility>

#include <fmt/format.h>
#include <tl/expected.hpp>

namespace imprint {

/// What kind of failure this is; it decides the exit status of a command.
enum class ErrorKind {
  invalid_input,  ///< wrong use, or an input that cannot be read or is not valid: exit status 2
  job_failed,     ///< the input was readable but the job could not be done: exit status 1
};

/// One line for a person: which file, key, camera or frame; what was expected; what was found; what to do.
struct Error {
  ErrorKind kind = ErrorKind::job_failed;
  std::string message;

  [[nodiscard]] int exit_status() const { return kind == ErrorKind::invalid_input ? 2 : 1; }
};

template <class T>
using Result = tl::expected<T, Error>;

template <class... Args>
[[nodiscard]] tl::unexpected<Error> invalid_input(fmt::format_string<Args...> format, Args&&... args) {
  return tl::make_unexpected(Error{ErrorKind::invalid_input, fmt::format(format, std::forward<Args>(args)...)});
}

template <class... Args>
[[nodiscard]] tl::unexpected<Error> job_failed(fmt::format_string<Args...> format, Args&&... args) {
  return tl::make_unexpected(Error{ErrorKind::job_failed, fmt::format(format, std::forward<Args>(args)...)});
}

/// Passes an error on unchanged to a caller whose value type differs.
[[nodiscard]] inline tl::unexpected<Error> pass_on(Error error) { return tl::make_unexpected(std::move(error)); }

}  // namespace imprint
