#include "tactus/rig/calibrate/report.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "tactus/base/error.h"
#include "tactus/rig/calibrate/coverage.h"

namespace tactus {
namespace {

__attribute__((format(printf, 2, 3))) void print(std::string& to, const char* format, ...) {
  char line[512];
  va_list values;
  va_start(values, format);
  std::vsnprintf(line, sizeof line, format, values);
  va_end(values);
  to += line;
}

/// File names and camera names come from people.
std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '<') {
      out += "&lt;";
    } else if (c == '&') {
      out += "&amp;";
    } else {
      out += c;
    }
  }
  return out;
}

/// The image with its cells, brighter where more corners were seen, and every corner with its view's residual
/// as colour.
std::string coverage_picture(const CalibrationReport& r, std::size_t c) {
  const Camera& camera = r.result.cameras[c].camera;
  const Coverage coverage = coverage_of(r.views, static_cast<Index>(c), {camera.width_px, camera.height_px});
  const double scale = 360.0 / camera.width_px, cell_x = 360.0 / kCoverageColumns,
               cell_y = scale * camera.height_px / kCoverageRows;
  std::string svg;
  print(svg, "<svg width=\"360\" height=\"%.0f\">", scale * camera.height_px);
  for (std::size_t i = 0; i < coverage.corners.size(); ++i) {
    const Index n = coverage.corners[i];
    const char* fill = n == 0 ? "#f6c9c9" : (n < 20 ? "#eef3e2" : "#d5e8c5");
    print(svg, "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"%s\" stroke=\"#fff\"/>",
          static_cast<double>(static_cast<Index>(i) % kCoverageColumns) * cell_x,
          static_cast<double>(static_cast<Index>(i) / kCoverageColumns) * cell_y, cell_x, cell_y, fill);
  }
  for (std::size_t i = 0; i < r.views.size(); ++i) {
    if (static_cast<std::size_t>(r.views[i].camera) != c) continue;
    const char* color = r.result.views[i].left_out ? "#c00" : "#246";
    for (const BoardCorner& corner : r.views[i].corners)
      print(svg, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"1.2\" fill=\"%s\"/>", scale * corner.px.x,
            scale * corner.px.y, color);
  }
  return svg + "</svg>";
}

/// RMS of each view as a bar.
std::string residual_picture(const CalibrationReport& r, std::size_t c) {
  double most = 0;
  std::size_t count = 0;
  for (const ViewResidual& v : r.result.views) {
    if (static_cast<std::size_t>(v.camera) != c) continue;
    most = std::max(most, std::min(v.rms_px, 1e4));
    ++count;
  }
  std::string svg = "<svg width=\"360\" height=\"90\">";
  double x = 0;
  const double step = 360.0 / static_cast<double>(std::max<std::size_t>(1, count));
  for (const ViewResidual& v : r.result.views) {
    if (static_cast<std::size_t>(v.camera) != c) continue;
    const double height = most > 0 ? 80 * std::min(v.rms_px, 1e4) / most : 0;
    print(svg,
          "<rect x=\"%.1f\" y=\"%.1f\" width=\"%.1f\" height=\"%.1f\" fill=\"%s\"><title>picture %d: %.2f "
          "px</title></rect>",
          x, 85 - height, std::max(0.5, step - 1), height, v.left_out ? "#c00" : "#579", v.instant, v.rms_px);
    x += step;
  }
  print(svg, "<text x=\"2\" y=\"10\" font-size=\"10\">RMS per picture, up to %.2f px</text></svg>", most);
  return svg;
}

/// Cameras (triangles) and the board's places (dots) from above.
std::string rig_picture(const CalibrationReport& r) {
  std::vector<Vec3d> eyes, looks, boards;
  double reach = 1e-6;
  for (const CalibratedCamera& c : r.result.cameras) {
    eyes.push_back(r.T_world_first * c.camera.center_world());
    looks.push_back(r.T_world_first.R * c.camera.axis_world());
  }
  const Vec3d middle{0.5 * r.board.square_m * r.board.columns, 0.5 * r.board.square_m * r.board.rows, 0};
  for (const auto& T : r.result.T_world_board) {
    if (T) boards.push_back(r.T_world_first * (*T * middle));
  }
  for (const auto* list : {&eyes, &boards}) {
    for (const Vec3d& p : *list) reach = std::max({reach, std::abs(p.x), std::abs(p.z)});
  }
  const double scale = 170 / reach;
  std::string svg = "<svg width=\"380\" height=\"380\"><g transform=\"translate(190,190)\">";
  for (const Vec3d& p : boards)
    print(svg, "<circle cx=\"%.1f\" cy=\"%.1f\" r=\"2\" fill=\"#9b7\"/>", scale * p.x, scale * p.z);
  for (std::size_t c = 0; c < eyes.size(); ++c) {
    const double x = scale * eyes[c].x, y = scale * eyes[c].z;
    print(svg,
          "<line x1=\"%.1f\" y1=\"%.1f\" x2=\"%.1f\" y2=\"%.1f\" stroke=\"#246\"/><circle cx=\"%.1f\" "
          "cy=\"%.1f\" r=\"4\" fill=\"#246\"/>",
          x, y, x + 25 * looks[c].x, y + 25 * looks[c].z, x, y);
    print(svg, "<text x=\"%.1f\" y=\"%.1f\" font-size=\"11\">", x + 6, y - 4);
    svg += escaped(r.result.cameras[c].camera.name) + "</text>";
  }
  return svg + "</g></svg>";
}

void add_camera(const CalibrationReport& r, std::size_t c, std::string& html) {
  const CalibratedCamera& camera = r.result.cameras[c];
  const CameraDeviations& d = r.result.deviations[c];
  const Camera& k = camera.camera;
  const Vec3d at = r.T_world_first * k.center_world();
  html += "<h2>" + escaped(k.name) + "</h2>" + coverage_picture(r, c) + residual_picture(r, c);
  const Coverage coverage = coverage_of(r.views, static_cast<Index>(c), {k.width_px, k.height_px});
  if (!coverage.advice.empty()) html += "<p class=\"advice\">" + coverage.advice + "</p>";
  print(html, "<p>RMS %.3f px</p><table><tr><th></th><th>value</th><th>standard deviation</th></tr>",
        r.result.camera_rms_px[c]);
  const auto row = [&](const char* name, double value, double deviation, const char* unit) {
    print(html, "<tr><td>%s</td><td>%.6g %s</td><td>%.2g %s</td></tr>", name, value, unit, deviation, unit);
  };
  row("fx", k.fx_px, d.fx_px, "px");
  row("fy", k.fy_px, d.fy_px, "px");
  row("cx", k.cx_px, d.cx_px, "px");
  row("cy", k.cy_px, d.cy_px, "px");
  static const char* const kBrown[] = {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"};
  static const char* const kFisheye[] = {"k1", "k2", "k3", "k4"};
  for (std::size_t i = 0; i < d.lens.size(); ++i)
    row(camera.lens.model == LensModel::fisheye ? kFisheye[i] : kBrown[i], camera.lens.k[i], d.lens[i], "");
  for (int i = 0; i < 3; ++i) {
    const char* const names[] = {"x", "y", "z"};
    row(names[i], at[i], d.center_m[i], "m");
  }
  print(html, "<tr><td>rotation</td><td></td><td>%.2g, %.2g, %.2g degrees</td></tr></table>",
        57.29578 * d.rotation_rad.x, 57.29578 * d.rotation_rad.y, 57.29578 * d.rotation_rad.z);
}

}  // namespace

std::string calibration_html(const CalibrationReport& r) {
  std::string html =
      "<!doctype html><html lang=\"en\"><meta "
      "charset=\"utf-8\"><title>Calibration</title><style>body{font:14px sans-serif;"
      "max-width:52em;margin:2em auto}table{border-collapse:collapse}td,th{padding:2px 10px;text-align:right}"
      ".advice{color:#a40}svg{margin-right:12px;background:#fafafa}</style><h1>Calibration</h1>";
  print(html, "<p>%zu cameras, %lld corners, RMS %.3f px.</p>", r.result.cameras.size(),
        static_cast<long long>(r.result.corners), r.result.rms_px);
  html += rig_picture(r);
  html +=
      "<p>From above: cameras, the way they look, and where the board was. Standard deviations follow from "
      "the residuals; "
      "those of places and turns are in the frame of the first camera.</p>";
  std::string out;
  for (const ViewResidual& v : r.result.views) {
    if (!v.left_out) continue;
    print(out, "<li>picture %d of ", v.instant);
    out += escaped(r.result.cameras[static_cast<std::size_t>(v.camera)].camera.name);
    print(out, ": RMS %.1f px, %d corners</li>", v.rms_px, v.corners);
  }
  if (!out.empty()) html += "<h2>Left out</h2><ul>" + out + "</ul>";
  for (std::size_t c = 0; c < r.result.cameras.size(); ++c) add_camera(r, c, html);
  return html + "</html>\n";
}

Box3f board_workspace(const CalibrationReport& r) {
  Vec3d low{1e30, 1e30, 1e30}, high = -low;
  for (const auto& T : r.result.T_world_board) {
    for (Index i = 0; T && i < r.board.corner_count(); ++i) {
      const Vec3d p = r.T_world_first * (*T * r.board.corner_m(i));
      low = min(low, p);
      high = max(high, p);
    }
  }
  const Vec3d pad = 0.1 * (high - low) + Vec3d{0.01, 0.01, 0.01};
  return {vec_cast<float>(low - pad), vec_cast<float>(high + pad)};
}

std::string rig_yaml(const CalibrationReport& r, const std::string& calibration) {
  const Box3f box = board_workspace(r);
  std::string yaml =
      "# Made by tactus calibrate rig. workspace_m is where the board was: set it to what shall be "
      "reconstructed.\n";
  print(yaml,
        "calibration: %s\nunit_m: 1\nup: +y\nworkspace_m: {min: [%.3f, %.3f, %.3f], max: [%.3f, %.3f, "
        "%.3f]}\ncameras:\n",
        calibration.c_str(), static_cast<double>(box.min.x), static_cast<double>(box.min.y),
        static_cast<double>(box.min.z), static_cast<double>(box.max.x), static_cast<double>(box.max.y),
        static_cast<double>(box.max.z));
  for (const CalibratedCamera& c : r.result.cameras) {
    yaml += "  - name: " + c.camera.name + "\n    # mask: masks/" + c.camera.name +
            "_%04d.png\n    # video: " + c.camera.name + ".mp4\n    # empty_room: " + c.camera.name +
            "_empty.mp4\n";
  }
  return yaml;
}

Rigidd world_on_board(const BundleResult& result, Index instant) {
  const auto& all = result.T_world_board;
  if (instant < 0 || instant >= std::ssize(all) || !all[static_cast<std::size_t>(instant)]) {
    throw usage_error("--floor " + std::to_string(instant) + ": the board was not found in picture " +
                      std::to_string(instant));
  }
  const Rigidd T_board_first = inverse(*all[static_cast<std::size_t>(instant)]);
  // The board's z axis points to the cameras, or away from them.
  double above = 0;
  for (const CalibratedCamera& c : result.cameras) above += (T_board_first * c.camera.center_world()).z;
  const Mat3d up =
      above > 0 ? Mat3d{{{1, 0, 0}, {0, 0, 1}, {0, -1, 0}}} : Mat3d{{{1, 0, 0}, {0, 0, -1}, {0, 1, 0}}};
  return Rigidd{up, {}} * T_board_first;
}

}  // namespace tactus
