#pragma once
/// What an error tells.
#include <gtest/gtest.h>

#include <optional>
#include <string>

#include "tactus/base/error.h"

namespace tactus::test {

/// The message of the Error that `body` throws, which must be of this kind if one is given; "" without one.
template <class F>
std::string message_of(F&& body, std::optional<ErrorKind> kind = std::nullopt) {
  try {
    body();
  } catch (const Error& e) {
    EXPECT_EQ(e.kind(), kind.value_or(e.kind())) << e.what();
    return e.what();
  }
  return "";
}

}  // namespace tactus::test
