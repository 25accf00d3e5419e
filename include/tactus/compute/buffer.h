#pragma once
/// Owned device memory. Move-only; sizes are fixed at construction, so frames allocate nothing.
#include <span>
#include <string>
#include <utility>

#include "tactus/base/error.h"
#include "tactus/compute/device.h"
#include "tactus/compute/view.h"

namespace tactus {

namespace detail {
/// Bytes of `count` elements. @throws Error when the count is negative or not indexable.
std::size_t checked_bytes(std::int64_t count, std::size_t element_size);
}  // namespace detail

/// `count` elements of T in the memory of `device`, uninitialised.
template <class T>
class Buffer {
 public:
  Buffer() = default;
  Buffer(Device& device, std::int64_t count)
      : device_(&device),
        size_(static_cast<Index>(count)),
        data_(static_cast<T*>(device.allocate(detail::checked_bytes(count, sizeof(T))))) {}
  Buffer(Buffer&& other) noexcept
      : device_(other.device_),
        size_(std::exchange(other.size_, 0)),
        data_(std::exchange(other.data_, nullptr)) {}
  Buffer& operator=(Buffer&& other) noexcept {
    std::swap(device_, other.device_);
    std::swap(size_, other.size_);
    std::swap(data_, other.data_);
    return *this;
  }
  ~Buffer() {
    if (data_ != nullptr) device_->deallocate(data_);
  }

  Index size() const { return size_; }
  bool empty() const { return size_ == 0; }
  View<T> view() { return {data_, size_}; }
  View<const T> view() const { return {data_, size_}; }
  View<const T> const_view() const { return {data_, size_}; }
  Device& device() const { return *device_; }

 private:
  Device* device_ = nullptr;
  Index size_ = 0;
  T* data_ = nullptr;
};

/// Host memory a device copies from and to without staging (pinned on CUDA).
template <class T>
class HostBuffer {
 public:
  HostBuffer() = default;
  HostBuffer(Device& device, std::int64_t count)
      : device_(&device),
        size_(static_cast<Index>(count)),
        data_(static_cast<T*>(device.allocate_host(detail::checked_bytes(count, sizeof(T))))) {}
  HostBuffer(HostBuffer&& other) noexcept
      : device_(other.device_),
        size_(std::exchange(other.size_, 0)),
        data_(std::exchange(other.data_, nullptr)) {}
  HostBuffer& operator=(HostBuffer&& other) noexcept {
    std::swap(device_, other.device_);
    std::swap(size_, other.size_);
    std::swap(data_, other.data_);
    return *this;
  }
  ~HostBuffer() {
    if (data_ != nullptr) device_->deallocate_host(data_);
  }

  Index size() const { return size_; }
  T* data() { return data_; }
  const T* data() const { return data_; }
  T& operator[](Index i) { return data_[i]; }
  const T& operator[](Index i) const { return data_[i]; }
  std::span<T> span() { return {data_, static_cast<std::size_t>(size_)}; }
  std::span<const T> span() const { return {data_, static_cast<std::size_t>(size_)}; }

 private:
  Device* device_ = nullptr;
  Index size_ = 0;
  T* data_ = nullptr;
};

}  // namespace tactus
