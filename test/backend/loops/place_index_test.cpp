// SPDX-License-Identifier: Apache-2.0
#include "backend/loops/place_index.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

namespace ignis {
namespace {

double horizontal(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return std::hypot(a.x() - b.x(), a.z() - b.z());
}

TEST(PlaceIndex, FindsWhatAFullSearchFindsAlsoAfterPlacesMoved) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> anywhere(-40.0, 40.0);
  std::uniform_real_distribution<double> radius(0.5, 20.0);
  const auto position = [&] { return Eigen::Vector3d(anywhere(random), anywhere(random), anywhere(random)); };
  PlaceIndex index(8.0);
  std::vector<Eigen::Vector3d> places;
  for (std::size_t i = 0; i < 400; ++i) {
    places.push_back(position());
    index.place(i, places.back());
  }
  for (std::size_t i = 0; i < 400; i += 3) {
    places[i] = position();
    index.place(i, places[i]);
  }
  EXPECT_EQ(index.size(), 400U);
  for (int round = 0; round < 50; ++round) {
    const Eigen::Vector3d centre = position();
    const double reach = radius(random);
    const std::vector<std::size_t> found = index.around(centre, reach);
    EXPECT_TRUE(std::ranges::is_sorted(found));
    EXPECT_EQ(std::ranges::adjacent_find(found), found.end()) << "each once";
    for (std::size_t i = 0; i < places.size(); ++i) {
      const bool listed = std::ranges::binary_search(found, i);
      if (horizontal(places[i], centre) <= reach) {
        EXPECT_TRUE(listed);
      }
      if (horizontal(places[i], centre) > std::sqrt(2.0) * (reach + 8.0)) {
        EXPECT_FALSE(listed);
      }
    }
  }
}

TEST(PlaceIndex, LooksAtNoMoreHoweverLongTheDrive) {
  PlaceIndex index(8.0);
  for (std::size_t i = 0; i < 50'000; ++i) index.place(i, {4.0 * static_cast<double>(i), 0.0, -3.0});
  EXPECT_LE(index.around({1000.0, 0.0, 0.0}, 8.0).size(), 8U);
}

}  // namespace
}  // namespace ignis
