#include <algorithm>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "tactus/base/error.h"
#include "tactus/base/read_file.h"
#include "tactus/rig/calibration_files/middlebury.h"
#include "tactus/rig/images/camera_file.h"
#include "tactus/rig/images/numbered_files.h"
#include "tactus/rig/sources/data_sources.h"

namespace tactus {
namespace {

namespace fs = std::filesystem;

/// The one file of the folder whose name ends so; "" without.
std::string file_ending(const std::string& folder, const std::string& ending) {
  std::set<std::string> found;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().string().ends_with(ending)) found.insert(entry.path());
  }
  return found.empty() ? "" : *found.begin();
}

/// The two "(x y z)" lines after "bounding box", with 5 % more on every side.
Box3f readme_box(const std::string& folder) {
  std::ifstream in(folder + "/README.txt");
  std::string line;
  while (std::getline(in, line) && line.find("bounding box") == std::string::npos) {
  }
  Vec3f corner[2];
  for (Vec3f& p : corner) {
    if (!std::getline(in, line) || std::sscanf(line.c_str(), " (%f %f %f)", &p.x, &p.y, &p.z) != 3) {
      throw Error(folder + "/README.txt: no bounding box; give the workspace");
    }
  }
  const Vec3f pad = 0.05F * (corner[1] - corner[0]);
  return {corner[0] - pad, corner[1] + pad};
}

class MiddleburySource final : public FrameSource {
 public:
  MiddleburySource(const std::string& folder, const DataOptions& options) : options_(options) {
    if (!fs::is_directory(folder)) throw Error(folder + ": no such folder" + suggest_file(folder));
    frame_window(folder, options.first_frame, options.last_frame, {0, 0});
    const std::string par = file_ending(folder, "_par.txt");
    if (par.empty()) throw Error(folder + ": no *_par.txt with the cameras");
    std::set<std::string> good;
    std::string word;
    if (const std::string list = file_ending(folder, "_good_silhouette_images.txt"); !list.empty()) {
      std::istringstream in(read_text(list, kMaxYamlBytes, ReadFrom::regular_file));
      while (in >> word) good.insert(word);
    }
    read_cameras(folder, par, good);
    // The silhouettes of the 15 good dino photos contradict one another by about a pixel: without slack their
    // hull covers 0.993 of them, with it 0.997.
    rig_.slack_px = 1;
    rig_.workspace_m = options.workspace_m ? *options.workspace_m : readme_box(folder);
  }
  const Rig& rig() const override { return rig_; }
  std::optional<int> frame_count() const override { return 1; }
  NextFrame next(FrameSet& frame) override {
    if (done_) return NextFrame::no_more_data;
    done_ = true;
    frame = {};
    for (const ColorImage& photo : photos_) {
      frame.silhouettes.push_back(threshold_silhouette(photo, options_.threshold));
    }
    if (options_.colors) frame.colors = photos_;
    status_ = odd_masks(rig_, frame);
    return NextFrame::success;
  }
  std::string status() const override { return status_; }

 private:
  void read_cameras(const std::string& folder, const std::string& par, const std::set<std::string>& good) {
    for (const MiddleburyCamera& from :
         read_middlebury_cameras(read_text(par, kMaxYamlBytes, ReadFrom::regular_file), par)) {
      const std::string& name = from.camera.name;
      if (good.empty() || good.contains(name)) add_camera(from.camera, folder + "/" + name, from.where);
    }
    if (rig_.cameras.empty()) throw Error(par + ": no camera");
  }
  /// All photos of a set have one size: another means a photo that was scaled or cropped after calibration.
  void add_camera(Camera camera, const std::string& photo, const std::string& where) {
    photos_.push_back(read_photo(photo));
    camera.width_px = photos_.back().width_px;
    camera.height_px = photos_.back().height_px;
    try {
      check_camera(camera);
    } catch (const Error& e) {
      throw Error(where + ": " + e.what());
    }
    const auto size = [](const ColorImage& p) {
      return std::to_string(p.width_px) + "x" + std::to_string(p.height_px);
    };
    if (size(photos_.back()) != size(photos_.front())) {
      throw Error(photo + ": the photo has " + size(photos_.back()) + " pixels, expected " +
                  size(photos_.front()) + " like the first");
    }
    rig_.cameras.push_back(std::move(camera));
  }

  DataOptions options_;
  Rig rig_;
  std::vector<ColorImage> photos_;
  bool done_ = false;
  std::string status_;
};

}  // namespace

std::unique_ptr<FrameSource> open_middlebury(const std::string& folder, const DataOptions& options) {
  return std::make_unique<MiddleburySource>(folder, options);
}

}  // namespace tactus
