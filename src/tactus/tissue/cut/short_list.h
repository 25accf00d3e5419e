#pragma once
/// Lists that are nearly always short.
#include <algorithm>
#include <cstddef>
#include <type_traits>
#include <vector>

namespace tactus::cut {

/// Its first N values lie in the list itself. Where there are more, all are in an array, whose capacity
/// stays.
template <class T, std::size_t N>
class ShortList {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  using value_type = T;
  ShortList() {}  // leaves the places as they are
  ShortList(const ShortList& other) : ShortList() { assign(other.begin(), other.end()); }
  ShortList& operator=(const ShortList& other) {
    if (this != &other) assign(other.begin(), other.end());
    return *this;
  }
  ~ShortList() = default;

  std::size_t size() const { return count_; }
  bool empty() const { return count_ == 0; }
  T* begin() { return count_ > N ? more_.data() : places_; }
  const T* begin() const { return count_ > N ? more_.data() : places_; }
  T* end() { return begin() + count_; }
  const T* end() const { return begin() + count_; }
  T& operator[](std::size_t k) { return begin()[k]; }
  const T& operator[](std::size_t k) const { return begin()[k]; }
  T& front() { return *begin(); }
  const T& front() const { return *begin(); }
  T& back() { return end()[-1]; }
  const T& back() const { return end()[-1]; }

  void clear() { count_ = 0; }
  /// New values are as they happen to be.
  void resize(std::size_t count) {
    if (count > N) {
      if (more_.size() < count) more_.resize(std::max(count, 2 * more_.size()));
      if (count_ <= N) std::copy_n(places_, count_, more_.data());
    } else if (count_ > N) {
      std::copy_n(more_.data(), count, places_);
    }
    count_ = count;
  }
  void push_back(const T& value) {
    const T copy = value;  // it may lie in the list
    resize(count_ + 1);
    back() = copy;
  }
  /// @param first of others than this list's
  template <class Iterator>
  void append(Iterator first, Iterator last) {
    const std::size_t before = count_;
    resize(count_ + static_cast<std::size_t>(std::distance(first, last)));
    std::copy(first, last, begin() + before);
  }
  template <class Iterator>
  void assign(Iterator first, Iterator last) {
    clear();
    append(first, last);
  }
  void erase(std::size_t k) {
    std::copy(begin() + k + 1, end(), begin() + k);
    resize(count_ - 1);
  }

 private:
  T places_[N];
  std::vector<T> more_;
  std::size_t count_ = 0;
};

}  // namespace tactus::cut
