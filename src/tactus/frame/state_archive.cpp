#include "tactus/frame/state_archive.h"

#include <cstring>

#include "tactus/base/error.h"

namespace tactus {
namespace {

constexpr std::string_view kMagic = "TACTUSCP";
constexpr std::size_t kHeader = kMagic.size() + sizeof(std::uint32_t) + 2 * sizeof(std::uint64_t);

/// @param at within `from`, by sizeof(T) at least
template <class T>
T get(const std::string& from, std::size_t at) {
  T v;
  std::memcpy(&v, from.data() + at, sizeof v);
  return v;
}

}  // namespace

StateArchive::StateArchive(std::string bytes, std::string path) : reads_(true), path_(std::move(path)) {
  if (bytes.size() < kHeader || !std::string_view(bytes).starts_with(kMagic))
    throw Error(path_ + ": it is no checkpoint of tactus run");
  std::size_t at = kMagic.size();
  const auto version = get<std::uint32_t>(bytes, at);
  if (version != kVersion)
    throw Error(path_ + ": it is a checkpoint of version " + std::to_string(version) + ", expected " +
                std::to_string(kVersion) + ": make it anew with this program");
  const auto length = get<std::uint64_t>(bytes, at += sizeof version);
  const auto hash = get<std::uint64_t>(bytes, at += sizeof length);
  payload_ = bytes.substr(kHeader);
  if (payload_.size() != length)
    throw Error(path_ + ": the checkpoint has " + std::to_string(payload_.size()) +
                " bytes after its header, " + "expected " + std::to_string(length) +
                ": it was cut short, or something was added");
  if (fnv1a(payload_) != hash) throw Error(path_ + ": the checkpoint was changed after it was written");
}

StateArchive StateArchive::for_larger(StateArchive written) {
  written.reads_ = written.is_for_larger_ = true;
  written.owner_.clear();
  return written;
}

void StateArchive::block(const std::string& name, void* data, std::size_t bytes) {
  const std::string full = owner_.empty() ? name : owner_ + ": " + name;
  if (!reads_) {
    put_bytes(payload_, static_cast<std::uint32_t>(full.size()));
    payload_ += full;
    put_bytes(payload_, static_cast<std::uint64_t>(bytes));
    payload_.append(static_cast<const char*>(data), bytes);
    return;
  }
  const auto refuse = [&](const std::string& found) {
    throw usage_error(path_ + ": the checkpoint is of another scene: it has " + found + " where '" + full +
                      "' of " + std::to_string(bytes) + " bytes was expected");
  };
  const std::size_t left = payload_.size() - at_;
  if (left < sizeof(std::uint32_t)) refuse("nothing");
  const std::size_t name_bytes = get<std::uint32_t>(payload_, at_);
  if (left < sizeof(std::uint32_t) + name_bytes + sizeof(std::uint64_t)) refuse("nothing that can be read");
  const std::string found =
      payload_.substr(at_ + sizeof(std::uint32_t), std::min<std::size_t>(name_bytes, 200));
  const std::size_t begin = at_ + sizeof(std::uint32_t) + name_bytes + sizeof(std::uint64_t);
  const auto size = get<std::uint64_t>(payload_, begin - sizeof(std::uint64_t));
  const bool fits = size == bytes || (is_for_larger_ && size < bytes);
  if (found != full || !fits || payload_.size() - begin < size)
    refuse("'" + found + "' of " + std::to_string(size) + " bytes");
  if (size > 0) std::memcpy(data, payload_.data() + begin, size);
  at_ = begin + size;
}

void StateArchive::check(bool ok, const char* name) const {
  if (!ok)
    throw Error(path_ + ": '" + (owner_.empty() ? "" : owner_ + ": ") + name +
                "' of the checkpoint holds numbers that no run writes");
}

void StateArchive::finish() const {
  if (at_ != payload_.size())
    throw usage_error(path_ + ": the checkpoint is of another scene: it has more than this one");
}

std::string StateArchive::with_header(const std::string& blocks) {
  std::string all(kMagic);
  put_bytes(all, kVersion);
  put_bytes(all, static_cast<std::uint64_t>(blocks.size()));
  put_bytes(all, fnv1a(blocks));
  return all + blocks;
}

}  // namespace tactus
