// What a cut looks up, against the containers of the standard library.
#include "tactus/tissue/cut/flat_lists.h"

#include <gtest/gtest.h>

#include <map>
#include <random>
#include <set>

#include "tactus/tissue/cut/point_blocks.h"
#include "tactus/tissue/cut/short_list.h"

namespace tactus::cut {
namespace {

TEST(FlatLists, HoldWhatTheStandardOnesHold) {
  std::mt19937 random(5);
  FlatMap<std::uint64_t, int> map;
  std::map<std::uint64_t, int> known;
  IndexSet set;
  std::set<Index> indices;
  Chains<Index> chains;
  chains.resize(100);
  std::vector<std::vector<Index>> lists(100);
  for (int k = 0; k < 3000; ++k) {
    const std::uint64_t key = std::uint64_t{random() % 1000} << 32U | random() % 3;
    EXPECT_EQ(map.try_emplace(key, k).second, known.try_emplace(key, k).second);
    const auto i = static_cast<Index>(random() % 5000);
    set.insert(i);
    indices.insert(i);
    chains.push_back(i % 100, i);
    lists[static_cast<std::size_t>(i % 100)].push_back(i);
  }
  for (const auto& [key, value] : known) EXPECT_EQ(*map.find(key), value);
  EXPECT_EQ(map.find(7777), nullptr);
  std::vector<Index> taken, again;
  set.take(taken);
  EXPECT_EQ(taken, std::vector<Index>(indices.begin(), indices.end()));
  set.take(again);
  EXPECT_TRUE(again.empty());
  for (Index list = 0; list < 100; ++list) {
    const auto of = chains.of(list);
    EXPECT_EQ(std::vector<Index>(of.begin(), of.end()), lists[static_cast<std::size_t>(list)]);
  }
}

TEST(FlatLists, AreEmptyOnceCleared) {
  FlatMap<std::uint64_t, int> map;
  Chains<Index> chains;
  for (int round = 0; round < 3; ++round) {
    chains.reset(4);
    for (Index list = 0; list < 4; ++list) EXPECT_TRUE(chains.empty(list));
    for (std::uint64_t key = 0; key < 100; ++key) EXPECT_TRUE(map.try_emplace(key, round).second) << round;
    EXPECT_EQ(*map.find(7), round);
    chains.push_back(2, round);
    EXPECT_EQ(*chains.of(2).begin(), round);
    map.clear();
    EXPECT_EQ(map.find(7), nullptr);
  }
}

/// Below, at and above the length that fits in place, and back.
TEST(ShortList, HoldsWhatAVectorHolds) {
  std::mt19937 random(9);
  ShortList<int, 4> list;
  std::vector<int> known;
  const auto expect_equal = [&](const ShortList<int, 4>& is) {
    ASSERT_EQ(std::vector<int>(is.begin(), is.end()), known);
    ASSERT_EQ(is.empty(), known.empty());
  };
  for (int k = 0; k < 5000; ++k) {
    const auto action = random() % 8;
    if (action < 3 || known.empty()) {
      list.push_back(k);
      known.push_back(k);
    } else if (action < 6) {
      const std::size_t place = random() % known.size();
      list.erase(place);
      known.erase(known.begin() + static_cast<std::ptrdiff_t>(place));
    } else if (action == 6) {
      list.push_back(list.front());  // of its own values
      known.push_back(int{known.front()});
    } else if (known.size() > 7) {
      list.clear();
      known.clear();
    } else {
      const std::array<int, 3> more{k, k + 1, k + 2};
      list.append(more.begin(), more.end());
      known.insert(known.end(), more.begin(), more.end());
    }
    expect_equal(list);
    const ShortList<int, 4> copy = list;
    expect_equal(copy);
    if (k % 7 == 0) list = copy;
  }
}

TEST(PointBlocks, BoxesHoldTheirPointsTightly) {
  std::mt19937 random(6);
  std::uniform_real_distribution<float> anywhere(-1, 1);
  std::vector<Vec3f> points(5 * PointBlocks::kSize + 3);
  for (Vec3f& p : points) p = {anywhere(random), anywhere(random), anywhere(random)};
  PointBlocks blocks;
  blocks.build(points);
  ASSERT_EQ(blocks.boxes().size(), 6U);
  for (std::size_t b = 0; b < 6; ++b) {
    Box3f box{points[b * PointBlocks::kSize], points[b * PointBlocks::kSize]};
    for (std::size_t i = b * PointBlocks::kSize; i < std::min((b + 1) * PointBlocks::kSize, points.size());
         ++i)
      box = {min(box.min, points[i]), max(box.max, points[i])};
    EXPECT_EQ(blocks.boxes()[b].min, box.min);
    EXPECT_EQ(blocks.boxes()[b].max, box.max);
  }
}

}  // namespace
}  // namespace tactus::cut
