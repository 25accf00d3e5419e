#include "tactus/rig/rig_keys.h"

#include <stdexcept>

#include "tactus/rig/calibration_files/calibration_file.h"

namespace tactus {

std::span<const RigSection> rig_sections() {
  static const char* const kRequired = "**required**";
  static const std::vector<RigSection> kSections{
      {"",
       {{"cameras", "list of mappings", kRequired, "the cameras whose silhouettes carve"},
        {"workspace_m", "mapping", kRequired, "the box that is reconstructed, +Y up"},
        {"calibration", "path", "", "calibration of all cameras that name none of their own"},
        {"calibration_format", "word", "by content",
         "a format of the table below, where content does not decide"},
        {"calibration_nodes", "mapping", "the usual names", "names of the nodes of OpenCV files"},
        {"lens", "`brown`, `fisheye`, `none`", "`brown`",
         "what distortion coefficients mean where the file does not say it"},
        {"unit_m", "number >= 1e-9 and <= 1e9 m", "asked for",
         "length of the calibration's unit: 1 for metres, 0.001 for millimetres. Required where the format "
         "does not "
         "fix it"},
        {"up", "`+x`, `-x`, `+y`, `-y`, `+z`, `-z`", "`+y`",
         "axis of the calibration's world that points up"},
        {"image_size_px", "[width, height], each 1 to 32768", "the calibration's",
         "size of the pictures. Required where the calibration does not say it, and checked where it does"},
        {"frames", "[first, last]", "all", "frames that are used, both included"},
        {"frames_per_s", "number >= 0.001 and <= 100000 1/s", "`50`", "of videos and sequences"},
        {"background", "mapping", "", "how silhouettes are separated from the empty room"},
        {"depth_cameras", "list of mappings", "", "time-of-flight cameras"},
        {"live", "mapping", "", "how live cameras reach the computer that reconstructs"}}},
      {"cameras[]",
       {{"name", "text", kRequired, "of the camera, once in the file"},
        {"calibration", "path", "the file's",
         "file or folder with this camera's calibration, of any known format"},
        {"calibration_camera", "text", "`name`", "its name in a calibration of several cameras"},
        {"image_size_px", "[width, height], each 1 to 32768", "the file's", "size of this camera's pictures"},
        {"mask", "path", "", "silhouette, or a pattern with one %d: a sequence"},
        {"photo", "path", "", "colours of the same, likewise"},
        {"video", "path", "", "film of the camera"},
        {"empty_room", "path", "", "film of the room without the subject"},
        {"device", "text", "",
         "of `tactus client`: `/dev/videoN`, the URL of a stream (rtsp://...), or `aravis:ID` of a GenICam "
         "camera (serial number or address)"}}},
      {"depth_cameras[]",
       {{"name", "text", kRequired, "of the camera, once in the file"},
        {"calibration", "path", "the file's", "file or folder with this camera's calibration"},
        {"calibration_camera", "text", "`name`", "its name in a calibration of several cameras"},
        {"image_size_px", "[width, height], each 1 to 32768", "the calibration's",
         "size of the depth images"},
        {"depth", "path", "", "16-bit PNG, or a pattern with one %d; what is not live needs it"},
        {"device", "text", "", "of `tactus client`: `aravis:ID` of a GenICam camera (Coord3D_C16 or Mono16)"},
        {"unit_m", "number >= 1e-6 and <= 1000 m", "`0.001`",
         "metres per unit of the image; 0 is no measurement"},
        {"distance", "`z`, `radial`", "`z`", "along the optical axis, or from the camera"},
        {"error_table", "path", "", "systematic error of the distance, as tactus calibrate tof writes it"}}},
      {"workspace_m",
       {{"min", "[x, y, z] m", kRequired, "lower corner"},
        {"max", "[x, y, z] m", kRequired, "upper corner"}}},
      {"background",
       {{"method", "model, key, mog2 or knn", "`model`",
         "the room's mean and spread, a coloured cloth, or OpenCV's subtractors"},
        {"chroma", "number >= 0 and <= 442 grey levels", "`9`", "distance off the line black-background"},
        {"darkest_shadow", "number >= 0 and <= 1", "`0.55`", "brightness ratios below are foreground"},
        {"brightest", "number >= 1 and <= 100", "`1.25`", "brightness ratios above are foreground"},
        {"noise", "number >= 0 and <= 442 grey levels", "`10`",
         "within it, a darker or brighter pixel is background"},
        {"spread", "number >= 0 and <= 100", "`4`",
         "or within so many standard deviations of the room's own noise"},
        {"adapt_s", "number >= 0 and <= 1000000 s", "`0`", "time constant of slow adaption; 0: none"},
        {"key", "[red, green, blue]", "`[0, 177, 64]`", "colour of the cloth"},
        {"key_degrees", "number >= 0 and <= 90", "`18`",
         "colours whose direction is nearer to the key's are cloth"},
        {"open_px", "whole number >= 0 and <= 50", "`1`", "radius of the opening that removes specks"},
        {"close_px", "whole number >= 0 and <= 50", "`3`", "radius of the closing"},
        {"largest_hole_px", "whole number >= 0 and <= 100000000", "`150`",
         "smaller holes are filled [pixels]"},
        {"least_part", "number >= 0 and <= 1", "`1`", "parts smaller than this share of the largest go"}}},
      {"live",
       {{"address", "tcp://HOST:PORT", "`tcp://127.0.0.1:7447`",
         "where `run` and `serve` listen and clients connect to"},
        {"sync", "`time`, `trigger`, `software`", "`time`",
         "images of one tick are known by when they were captured, by the number of their trigger, or the "
         "server sends the triggers"},
        {"deadline_s", "number >= 0.001 and <= 1 s", "`0.033`",
         "from the capture to the release of a set that is not complete"},
        {"most_bytes_per_s", "number >= 1000 and <= 1e9", "`2e7`", "of one camera; more is refused"},
        {"keys", "path", "`keys` beside the file", "folder of keys that `tactus keys` made"}}},
      {"calibration_nodes",
       {{"intrinsics", "text", "the usual names", "node of the camera matrix"},
        {"distortion", "text", "the usual names", "node of the distortion"},
        {"rotation", "text", "the usual names", "node of the rotation, vector or matrix"},
        {"translation", "text", "the usual names", "node of the translation"}}}};
  return kSections;
}

std::vector<std::string> rig_keys(const std::string& where) {
  for (const RigSection& section : rig_sections()) {
    if (where != section.where) continue;
    std::vector<std::string> names;
    for (const RigKey& key : section.keys) names.emplace_back(key.name);
    return names;
  }
  throw std::out_of_range("rig file: no section '" + where + "'");
}

void write_rig_reference(std::ostream& out) {
  out << "# Rig files\n\n"
         "<!-- Generated from the declaration in src/tactus/rig/rig_keys.cpp: change it there. -->\n\n"
         "A rig file says where the cameras stand and where their pictures lie. It is YAML;\n"
         "`tactus reconstruct --source masks RIG.yaml` and `--source videos RIG.yaml` read it, and scenes "
         "do.\n"
         "Its world has +Y up and metres. A relative path starts at the folder of the rig file, else at\n"
         "`$TACTUS_DATA`. An unknown, duplicate or missing key, a wrong type and a value out of range are "
         "refused\n"
         "with file and line. `rigs/` holds examples.\n";
  for (const RigSection& section : rig_sections()) {
    if (*section.where != '\0') out << "\n## `" << section.where << "`\n";
    out << "\n| key | type | default | meaning |\n|---|---|---|---|\n";
    for (const RigKey& key : section.keys) {
      out << "| `" << key.name << "` | " << key.type << " | " << key.otherwise << " | " << key.meaning
          << " |\n";
    }
  }
  out << "\n## Calibrations that are read\n\n"
         "The format is found by content. Axes, direction of the pose, origin of the pixels and unit are "
         "converted\n"
         "when the file is read; what a format leaves open is asked for, never guessed.\n"
         "`tactus calibration convert IN OUT --to FORMAT` writes those marked.\n\n"
         "| format | what | written | asks for |\n|---|---|---|---|\n";
  for (const CalibrationFormatInfo& f : calibration_formats())
    out << "| `" << f.name << "` | " << f.of << " | " << (f.written ? "yes" : "") << " | " << f.asks
        << " |\n";
  out << "\n"
         "Programs do not agree on Qualisys files. Focal lengths and centres count 1/64 of a pixel, as "
         "`sensorMaxU` does (64 times\n"
         "the sensor's width, less one). Distortion is that of ideal coordinates, which have no unit, so it "
         "is not divided by 64.\n"
         "Pose2Sim divides it, so its Calib.toml has hardly any distortion left; readers of the LBMC data "
         "set take it from the\n"
         ".qca.txt again. Theia writes the same XML with whole pixels and another pose: it is refused by "
         "name. Pictures are taken\n"
         "as the sensor gives them: one that was turned upright after (`viewrotation`) does not fit.\n";
}

}  // namespace tactus
