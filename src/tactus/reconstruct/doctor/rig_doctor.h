#pragma once
/// Finds the wrong cameras of a rig, their faults and the cures, by silhouettes alone: hypotheses are tried,
/// and recall of the re-projected hull decides. Silhouettes can't see some faults, above all a scale common
/// to all cameras: those need other evidence.
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "tactus/reconstruct/doctor/rig_hypotheses.h"
#include "tactus/reconstruct/doctor/silhouette_consistency.h"

namespace tactus {

struct DoctorInput {
  std::vector<Camera> cameras;
  /// Masks of several ticks, one per camera each; the first is examined, the others tell late cameras.
  std::vector<std::vector<BitMask>> ticks;
  Box3f workspace_m;
  /// From the world to that of the calibration files (the rig file's `up`): slips are the files'.
  Mat3d R_file_world = Mat3d::identity();
};

struct DoctorFinding {
  int camera = -1;  ///< -1: all
  int other = -1;   ///< the second of two that are swapped
  std::string fault, cure;
  double recall_before = 0, recall_after = 0;  ///< mean over the views
  bool is_fault = true;                        ///< false: worth a word, nothing wrong
};

enum class Verdict : std::uint8_t { well, faulty, unsure };

struct Diagnosis {
  Verdict verdict = Verdict::unsure;
  std::vector<DoctorFinding> findings;
  std::string why;                                  ///< the verdict in a sentence
  std::string help;                                 ///< of `unsure`: evidence that would help
  std::vector<double> recall_before, recall_after;  ///< per view
  /// The rig with all cures.
  std::vector<Camera> cameras;
  std::vector<BitMask> masks;
  std::vector<int> late_by_ticks;
  Box3f workspace_m;
};

/// Silhouettes of one tick determine a rig up to its scale only where they give as many equations as there
/// are unknowns: two frontier points a pair, n (n - 1), against 6 n - 7. That begins with six views.
inline constexpr std::size_t kDeterminedViews = 6;

/// Recall of all views above which a rig is consistent.
struct DoctorLimits {
  double mean_recall = 0.985, least_recall = 0.96;
};

/// @throws Error without cameras or masks, or when their sizes contradict one another.
Diagnosis examine_rig(const DoctorInput& input, const DoctorLimits& limits = {});

/// The slip of all calibrations alike that explains why views contradict one another, and its cure; "" where
/// they agree, or none does.
std::string common_slip(const DoctorInput& input, const DoctorLimits& limits = {});

/// Whether other focal lengths would fit better by so little that poses may be the cause: nothing that
/// silhouettes say decides it.
bool doubts_focal_lengths(const Diagnosis& diagnosis);

/// "well", "faulty", "unsure"
const char* verdict_name(Verdict verdict);

}  // namespace tactus
