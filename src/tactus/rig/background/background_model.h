#pragma once
/// The empty room, pixel by pixel, and the mask of the subject before it. One object per camera; all cleaning
/// is on packed bits.
#include <memory>
#include <string>

#include "tactus/geom/image/image.h"
#include "tactus/geom/image/mask_cleaning.h"

namespace tactus {

enum class BackgroundMethod : std::uint8_t {
  model,  ///< mean and spread of the room, shadow by chromaticity (Horprasert, Harwood, Davis 1999)
  key,    ///< everything that has not the key's colour
  mog2,   ///< OpenCV's mixtures (Zivkovic 2004)
  knn,    ///< OpenCV's nearest neighbours (Zivkovic, van der Heijden 2006)
};

/// A pixel is foreground when its colour is off the line black-background (chromaticity distortion) or its
/// brightness ratio is not that of a shadow. The background is the room at the gain and offset of the photo,
/// which are fitted (background_exposure.h): cameras that adjust their exposure, and a sun that comes out.
struct BackgroundOptions {
  BackgroundMethod method = BackgroundMethod::model;
  double chroma = 9;             ///< distance off the line [grey levels]
  double darkest_shadow = 0.55;  ///< brightness ratios below are foreground
  double brightest = 1.25;       ///< brightness ratios above are foreground
  double noise = 10;        ///< a darker or brighter pixel within this distance is background [grey levels]
  double spread = 4;        ///< or within so many standard deviations of the room's own noise there, if more
  double adapt_s = 0;       ///< time constant of slow adaption [s]; 0: none
  Rgb8 key{0, 177, 64};     ///< colour of the cloth
  double key_degrees = 18;  ///< colours whose direction is nearer to the key's are cloth
  int open_px = 1, close_px = 3;
  int largest_hole_px = 150;  ///< smaller holes are filled [pixels]: larger ones are seen through
  double least_part = 1;      ///< parts smaller than this share of the largest go
};

class BackgroundModel {
 public:
  BackgroundModel(Index width_px, Index height_px);
  ~BackgroundModel();
  BackgroundModel(BackgroundModel&&) noexcept;
  BackgroundModel& operator=(BackgroundModel&&) noexcept;

  /// One more photo of the empty room (BGR bytes, tightly packed): mean and spread. One still picture is
  /// enough; its spread is unknown, and `noise` counts.
  void learn(const std::uint8_t* bgr);
  /// Photos of a film with a moving subject: the median of each pixel, and the median distance from it, are
  /// the room's. Holds up to 31 photos; `finish_median` makes the model of them.
  void collect(const std::uint8_t* bgr);
  void finish_median();
  /// Writes and reads the learnt room: an 8-bit BGR picture of the means above one of the spreads (16 a grey
  /// level). @throws Error naming file and size.
  void write(const std::string& file) const;
  void read(const std::string& file);

  /// Mask of the pixels that are not the room, cleaned. Allocates nothing after the first call. @param dt_s
  /// since the last photo; the room's slow changes are learnt where nothing stands, never nearer than a few
  /// pixels to the subject.
  void classify(const std::uint8_t* bgr, const BackgroundOptions& options, BitMask& mask, double dt_s = 0);
  /// How much of each pixel the subject covers, of the photo and mask of the last `classify`: by the mixture
  /// of room and subject within 2 px of the contour; the mask itself elsewhere and before a cloth. Allocates
  /// nothing after the first call.
  void alpha(const std::uint8_t* bgr, const BackgroundOptions& options, const BitMask& mask,
             AlphaImage& alpha);
  /// Standard deviation of the room's noise, mean over the picture [grey levels]; 0 after one photo.
  double mean_spread() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// @throws usage Error for another word than model, key, mog2 or knn.
BackgroundMethod background_method(const std::string& word);
/// Which library a build without `mog2` and `knn` lacks, and its package; "": none.
std::string subtractors_missing();

}  // namespace tactus
