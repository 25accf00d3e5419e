#pragma once
/// Sets, maps and lists that grow in few arrays: the entries of a cut cost no allocation each.
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <iterator>
#include <utility>
#include <vector>

#include "tactus/base/hd.h"

namespace tactus::cut {

inline std::uint64_t hash_of(std::uint64_t key) {
  key *= 0x9E3779B97F4A7C15ULL;
  return key ^ key >> 32U;
}
inline std::uint64_t hash_of(const std::array<Index, 4>& key) {
  std::uint64_t sum = 0;
  for (const Index k : key) sum = hash_of(sum + static_cast<std::uint32_t>(k));
  return sum;
}

/// Looks random, and does for sums (splitmix64).
inline std::uint64_t mixed(std::uint64_t key) {
  key = (key ^ key >> 30U) * 0xBF58476D1CE4E5B9ULL;
  key = (key ^ key >> 27U) * 0x94D049BB133111EBULL;
  return key ^ key >> 31U;
}

/// So many cubes may fall apart in a frame before lists grow.
inline constexpr std::size_t kFrameSplits = 512;
/// Capacity for so many values, with its pages in place: a frame that fills it waits for none.
template <class T>
void take_capacity(std::vector<T>& values, std::size_t count) {
  const std::size_t now = values.size();
  if (count <= now) return;
  values.resize(count);
  values.resize(now);
}

/// A map whose keys stay, with linear probing.
template <class Key, class Value>
class FlatMap {
 public:
  const Value* find(const Key& key) const {
    if (count_ == 0) return nullptr;
    for (std::size_t i = place(key);; i = (i + 1) & (slots_.size() - 1)) {
      if (!slots_[i].is_used) return nullptr;
      if (slots_[i].key == key) return &slots_[i].value;
    }
  }
  bool contains(const Key& key) const { return find(key) != nullptr; }
  /// @returns the value, valid until the next call, and whether it is new
  std::pair<Value*, bool> try_emplace(const Key& key, const Value& value) {
    if (3 * (count_ + 1) > 2 * slots_.size()) grow(std::max(std::size_t{64}, 2 * slots_.size()));
    std::size_t i = place(key);
    for (; slots_[i].is_used; i = (i + 1) & (slots_.size() - 1))
      if (slots_[i].key == key) return {&slots_[i].value, false};
    slots_[i] = {key, value, true};
    ++count_;
    return {&slots_[i].value, true};
  }
  /// Its capacity stays.
  void clear() {
    if (count_ > 0) std::fill(slots_.begin(), slots_.end(), Slot{});
    count_ = 0;
  }
  void reserve(std::size_t count) {
    if (3 * count > 2 * slots_.size()) grow(std::bit_ceil(3 * count / 2 + 1));
  }

 private:
  struct Slot {
    Key key{};
    Value value{};
    bool is_used = false;
  };
  std::size_t place(const Key& key) const { return hash_of(key) & (slots_.size() - 1); }
  void grow(std::size_t size) {
    std::vector<Slot> old(size);
    std::swap(old, slots_);
    for (const Slot& slot : old) {
      if (!slot.is_used) continue;
      std::size_t i = place(slot.key);
      while (slots_[i].is_used) i = (i + 1) & (slots_.size() - 1);
      slots_[i] = slot;
    }
  }
  std::vector<Slot> slots_;  ///< a power of two
  std::size_t count_ = 0;
};

/// Many short lists that grow at their ends, in one array.
template <class T>
class Chains {
  struct Link {
    T value;
    Index next;
  };

 public:
  /// Lists that there are; those from `count` on are dropped.
  void resize(Index count) { ends_.resize(static_cast<std::size_t>(count)); }
  Index count() const { return static_cast<Index>(ends_.size()); }
  /// There are so many lists, and nothing in them.
  void reset(Index count) {
    ends_.assign(static_cast<std::size_t>(count), Ends{});
    links_.clear();
  }
  /// For more lists, and values in them.
  void take_capacity_for(std::size_t lists, std::size_t values) {
    take_capacity(ends_, ends_.size() + lists);
    take_capacity(links_, links_.size() + values);
  }
  bool empty(Index list) const { return ends_[at(list)].first < 0; }
  T& push_back(Index list, const T& value) {
    Ends& ends = ends_[at(list)];
    const auto place = static_cast<Index>(links_.size());
    links_.push_back({value, -1});
    (ends.first < 0 ? ends.first : links_[at(ends.last)].next) = place;
    ends.last = place;
    return links_.back().value;
  }

  template <class Links, class Value>
  class Range {
   public:
    struct Iterator {
      using iterator_category = std::forward_iterator_tag;
      using value_type = T;
      using difference_type = std::ptrdiff_t;
      using pointer = Value*;
      using reference = Value&;
      Links* links = nullptr;
      Index place = -1;
      Value& operator*() const { return (*links)[at(place)].value; }
      Iterator& operator++() {
        place = (*links)[at(place)].next;
        return *this;
      }
      Iterator operator++(int) {
        const Iterator before = *this;
        ++*this;
        return before;
      }
      bool operator==(const Iterator& other) const { return place == other.place; }
    };
    Range(Links& links, Index first) : links_(&links), first_(first) {}
    Iterator begin() const { return {links_, first_}; }
    Iterator end() const { return {links_, -1}; }

   private:
    Links* links_;
    Index first_;
  };
  /// In the order in which they came. They may change, the list must not.
  auto of(Index list) { return Range<std::vector<Link>, T>(links_, ends_[at(list)].first); }
  auto of(Index list) const { return Range<const std::vector<Link>, const T>(links_, ends_[at(list)].first); }

 private:
  static std::size_t at(Index i) { return static_cast<std::size_t>(i); }
  struct Ends {
    Index first = -1, last = -1;
  };
  std::vector<Ends> ends_;
  std::vector<Link> links_;
};

/// Indices that are collected to be gone through once, ascending. Its time follows the number of indices in
/// it.
class IndexSet {
 public:
  void insert(Index i) {
    const auto word = static_cast<std::size_t>(i) / 64;
    if (word >= bits_.size()) bits_.resize(std::max(word + 1, 2 * bits_.size()));
    if (bits_[word] == 0) words_.push_back(word);
    bits_[word] |= std::uint64_t{1} << static_cast<unsigned>(i) % 64U;
  }
  /// All, ascending; then it is empty.
  void take(std::vector<Index>& all) {
    all.clear();
    std::sort(words_.begin(), words_.end());
    for (const std::size_t word : words_)
      for (std::uint64_t left = std::exchange(bits_[word], 0); left != 0; left &= left - 1)
        all.push_back(static_cast<Index>(64 * word) + std::countr_zero(left));
    words_.clear();
  }

 private:
  std::vector<std::uint64_t> bits_;
  std::vector<std::size_t> words_;  ///< that are not 0
};

}  // namespace tactus::cut
