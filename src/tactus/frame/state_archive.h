#pragma once
/// The state from which a run goes on, as named blocks of bytes. One declaration of a state both writes and
/// reads it.
#include <cstdint>
#include <string>
#include <type_traits>
#include <vector>

#include "tactus/base/byte_io.h"
#include "tactus/compute/exec_context.h"

namespace tactus {

/// A file of blocks, each with a name and the bytes of plain values, in the order in which they were
/// declared:
///
///   "TACTUSCP", version (u32), length of all blocks (u64), their FNV-1a hash (u64);
///   per block: length of the name (u32), the name, number of bytes (u64), the bytes
///
/// Numbers are little-endian. A file that is read must have the same blocks, each of the same length: nothing
/// in it decides how much memory is taken.
///
///   void archive(StateArchive& a) {      // of a class with state
///     a.value("clock", clock_s_);
///     a.buffer(ctx, "positions", x_m_);
///   }
class StateArchive {
 public:
  static constexpr std::uint32_t kVersion = 4;
  /// To be filled.
  StateArchive() = default;
  /// To be read. @param bytes of a file, as bytes() made them @param path for messages
  /// @throws Error when the file is no checkpoint, was cut short or changed, or is of another version.
  StateArchive(std::string bytes, std::string path);
  /// To be read by what has more capacity than what wrote it: a list that is longer now keeps its own values
  /// behind those that were written.
  static StateArchive for_larger(StateArchive written);

  bool reads() const { return reads_; }
  const std::string& path() const { return path_; }
  /// Names of blocks begin with that from now on, and in messages.
  void set_owner(const std::string& owner) { owner_ = owner; }

  /// @throws Error when the next block is another one.
  template <class T>
  void value(const char* name, T& v) {
    static_assert(std::is_trivially_copyable_v<T>);
    block(name, &v, sizeof v);
  }
  /// As many as there are.
  template <class T>
  void values(const char* name, std::vector<T>& v) {
    static_assert(std::is_trivially_copyable_v<T>);
    block(name, v.data(), v.size() * sizeof(T));
  }
  /// Synchronizes.
  template <class T>
  void buffer(ExecContext& ctx, const char* name, Buffer<T>& b) {
    std::vector<T> host = reads_ && !is_for_larger_ ? std::vector<T>(static_cast<std::size_t>(b.size()))
                                                    : to_host(ctx, b.const_view());
    values(name, host);
    if (!reads_) return;
    ctx.upload(host, b.view());
    ctx.synchronize();
  }
  /// Checks a value that was read and is used as an index. @throws Error when it is not `ok`.
  void check(bool ok, const char* name) const;
  /// That were not read yet.
  std::size_t bytes_left() const { return payload_.size() - at_; }
  /// Nothing may follow. @throws Error.
  void finish() const;
  /// The whole file: header and blocks.
  std::string bytes() const { return with_header(payload_); }
  static std::string with_header(const std::string& blocks);

 private:
  void block(const std::string& name, void* data, std::size_t bytes);
  bool reads_ = false, is_for_larger_ = false;
  std::string payload_, path_, owner_;
  std::size_t at_ = 0;
};

}  // namespace tactus
