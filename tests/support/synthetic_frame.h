#pragma once
/// What the default synthetic rig sees of a figure.
#include <gtest/gtest.h>

#include <string>

#include "tactus/rig/synthetic/synthetic_source.h"

namespace tactus::test {

struct SyntheticFrame {
  Rig rig;
  FrameSet frame;
};
/// Silhouettes alone, of the first frame ("rabbit-still": it stands).
inline SyntheticFrame silhouettes_of(const std::string& figure) {
  SyntheticSource source({.figure = figure, .depth = false, .truth = false});
  SyntheticFrame seen{source.rig(), {}};
  EXPECT_EQ(source.next(seen.frame), NextFrame::success);
  return seen;
}

}  // namespace tactus::test
