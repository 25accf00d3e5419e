#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>

#include "tactus/base/base64.h"
#include "tactus/base/camera_lines.h"
#include "tactus/base/compared_text.h"
#include "tactus/base/error.h"
#include "tactus/base/free_memory.h"
#include "tactus/base/printable.h"
#include "tactus/base/timing.h"
#include "tactus/base/vec.h"

namespace tactus {
namespace {

TEST(Math, SinCosMatchesLibm) {
  // Taylor remainders at pi/4: x^11/11! = 1.8e-9 and x^12/12! = 1e-10; the rest is rounding of a few ulp
  // of 1.
  for (float x = -40; x < 40; x += 0.00317F) {
    const SinCos r = sin_cos(x);
    EXPECT_NEAR(r.sin, std::sin(static_cast<double>(x)), 4e-7) << x;
    EXPECT_NEAR(r.cos, std::cos(static_cast<double>(x)), 4e-7) << x;
  }
}

TEST(Math, ExpMatchesLibm) {
  // r <= ln2/2: truncation r^7/7! = 1.2e-7 relative at most, plus 2 ulp.
  for (float x = -80; x < 80; x += 0.0171F) {
    const double truth = std::exp(static_cast<double>(x));
    EXPECT_NEAR(exp(x) / truth, 1.0, 4e-7) << x;
  }
}

TEST(Math, LogMatchesLibm) {
  // |a| <= 0.172: truncation 2 a^11 / 11 = 7e-10, and some ulp of the terms.
  for (float x = 1e-30F; x < 1e30F; x *= 1.0173F) {
    const double truth = std::log(static_cast<double>(x));
    EXPECT_NEAR(log(x), truth, 2e-7 * (1 + std::abs(truth))) << x;
  }
  EXPECT_EQ(log(1.F), 0);
}

/// "0.2 m, expected at most 0.2 m" helps nobody.
TEST(IndependentText, ANumberReadsUnlikeItsLimit) {
  EXPECT_EQ(number_text(0.35, 0.2), "0.35");
  EXPECT_EQ(number_text(0.2, 0.2), "0.2");
  EXPECT_EQ(number_text(0.20000004, 0.2), "0.20000004");
  EXPECT_EQ(number_text(std::nextafter(0.2, 1), 0.2), "0.20000000000000004");
  EXPECT_EQ(number_text(-0.09999999, -0.1), "-0.09999999");
  EXPECT_EQ(bytes_text(4300000, 67108864), "4.3 MB");
  EXPECT_EQ(bytes_text(67108865, 67108864), "67108865 B");
}

TEST(Math, FloorToIntOnBothSidesOfZero) {
  EXPECT_EQ(floor_to_int(-0.5F), -1);
  EXPECT_EQ(floor_to_int(-2.F), -2);
  EXPECT_EQ(floor_to_int(2.99F), 2);
}

TEST(Vec, InverseTimesMatrixIsIdentity) {
  const Mat3d m{{{2, 1, 0}, {-1, 3, .5}, {.25, 0, 1}}};
  const Mat3d one = inverse(m) * m;
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) EXPECT_NEAR(one(i, j), i == j ? 1 : 0, 1e-14);
  }
}

TEST(Vec, QuaternionRotatesLikeRodrigues) {
  const Mat3f R = rotation_matrix(axis_angle({0, 0, 1}, kPi / 2));
  const Vec3f y = R * Vec3f{1, 0, 0};
  EXPECT_NEAR(y.x, 0, 1e-6);
  EXPECT_NEAR(y.y, 1, 1e-6);
}

TEST(Error, NearestSpelling) {
  const std::string known[] = {"resolution", "cameras", "bodies"};
  EXPECT_EQ(nearest_spelling("resoluton", known), "resolution");
  EXPECT_EQ(nearest_spelling("camreas", known), "cameras");
  EXPECT_EQ(nearest_spelling("xyz", known), "");
  EXPECT_EQ(nearest_spelling("BODIES", known), "bodies");
  EXPECT_EQ(nearest_spelling("bodys", known), "bodies");
  const std::string with_units[] = {"gravity_m_s2", "density_kg_m3", "size_m", "so"};
  EXPECT_EQ(nearest_spelling("gravity", with_units), "gravity_m_s2");
  EXPECT_EQ(nearest_spelling("Size", with_units), "size_m");
  EXPECT_EQ(bytes_text(1.25e10), "12.5 GB");
}

TEST(Printable, ControlCharactersOfAFileDoNotReachTheTerminal) {
  EXPECT_EQ(printable("caf\xc3\xa9\n\t"), "caf\xc3\xa9\n\t");
  EXPECT_EQ(printable(std::string("a\0\x1b[2J\x7f", 7)), "a\\x00\\x1b[2J\\x7f");
}

TEST(Timing, Percentiles) {
  EXPECT_DOUBLE_EQ(percentile({3, 1, 2}, 50), 2);
  EXPECT_DOUBLE_EQ(percentile({0, 10}, 99), 9.9);
  EXPECT_DOUBLE_EQ(percentile({}, 50), 0);
}

/// The examples of RFC 4648.
TEST(Base64, PadsToFourDigits) {
  const std::pair<const char*, const char*> examples[] = {
      {"", ""}, {"f", "Zg=="}, {"fo", "Zm8="}, {"foo", "Zm9v"}, {"foobar", "Zm9vYmFy"}};
  for (const auto& [bytes, text] : examples) EXPECT_EQ(base64(bytes), text);
}

/// Some, and no more than the computer has.
TEST(FreeMemory, IsAPartOfTheMemory) {
  const double all =
      static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
  EXPECT_GT(free_memory_bytes(), 1e6);
  EXPECT_LT(free_memory_bytes(), all);
}

TEST(CameraLines, SayTheSameOfSeveralInOne) {
  const std::string text =
      "slow; camera 'a': a_7.png is 3 % off; camera 'b': black; camera 'c': c_18.png is 40 % off; camera "
      "'d': "
      "black; camera 'e': white";
  EXPECT_EQ(grouped_camera_lines(text),
            (std::vector<std::string>{"slow", "camera 'a': a_7.png is 3 % off; likewise 'c'",
                                      "camera 'b': black; likewise 'd'", "camera 'e': white"}));
  EXPECT_EQ(grouped_camera_lines("frame 1; frame 2"), std::vector<std::string>{"frame 1; frame 2"});
  EXPECT_EQ(grouped_camera_lines(""), std::vector<std::string>{""});
  // A camera may be called by a number, or by a word of the text.
  EXPECT_EQ(grouped_camera_lines("camera '1': dark; camera 'dark': dark"),
            (std::vector<std::string>{"camera '1': dark", "camera 'dark': dark"}));
}

}  // namespace
}  // namespace tactus
