#pragma once
/// Wakes a thread that waits for descriptors.
namespace tactus {

/// Wakes a thread that polls its file descriptor.
class WakeUp {
 public:
  WakeUp();
  ~WakeUp();
  WakeUp(const WakeUp&) = delete;
  WakeUp& operator=(const WakeUp&) = delete;
  int fd() const { return fd_; }
  void wake() const;
  void clear() const;

 private:
  int fd_;
};

}  // namespace tactus
