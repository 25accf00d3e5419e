#pragma once
/// Plain values as little-endian bytes, for files and packets.
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <type_traits>

namespace tactus {

static_assert(std::endian::native == std::endian::little);

/// Appends the bytes of a value.
template <class T>
void put_bytes(std::string& to, T v) {
  static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
  char bytes[sizeof(T)];
  std::memcpy(bytes, &v, sizeof v);
  to.append(bytes, sizeof v);
}

/// Overwrites bytes that are there: `at + sizeof v <= to.size()`.
template <class T>
void set_bytes(std::string& to, std::size_t at, T v) {
  static_assert(std::is_arithmetic_v<T> || std::is_enum_v<T>);
  std::memcpy(to.data() + at, &v, sizeof v);
}

/// Takes values from the front of foreign bytes. Reads past the end give zeros and fail for good, so a parser
/// asks `failed` once, before it uses the values.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}

  template <class T>
  T take() {
    static_assert(std::is_arithmetic_v<T>);
    T v{};
    const std::string_view bytes = take(sizeof v);
    if (bytes.size() == sizeof v) std::memcpy(&v, bytes.data(), sizeof v);
    return v;
  }
  /// The next bytes; none of them where fewer are left.
  std::string_view take(std::uint64_t count) {
    if (count > rest_.size()) {
      failed_ = true;
      rest_ = {};
      return {};
    }
    const std::string_view taken = rest_.substr(0, static_cast<std::size_t>(count));
    rest_.remove_prefix(static_cast<std::size_t>(count));
    return taken;
  }
  std::size_t left() const { return rest_.size(); }
  bool failed() const { return failed_; }
  /// For errors that the caller finds in the values.
  void fail() { failed_ = true; }

 private:
  std::string_view rest_;
  bool failed_ = false;
};

/// Hash of 64 bits (Fowler, Noll and Vo, FNV-1a). It finds accidents, not forgeries.
inline std::uint64_t fnv1a(std::string_view bytes, std::uint64_t hash = 0xcbf29ce484222325U) {
  for (const char c : bytes) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3U;
  return hash;
}

}  // namespace tactus
