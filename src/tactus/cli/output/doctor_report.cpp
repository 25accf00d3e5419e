#include "tactus/cli/output/doctor_report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <functional>
#include <sstream>

#include "tactus/base/camera_lines.h"
#include "tactus/base/safe_file.h"

namespace tactus {
namespace {

std::string number(double value, const char* format) {
  char text[32];
  std::snprintf(text, sizeof text, format, value);
  return text;
}

std::string camera_name(const DoctorReport& report, const DoctorFinding& f) {
  if (f.camera < 0) return "all";
  std::string name = report.given[static_cast<std::size_t>(f.camera)].name;
  if (f.other >= 0) name += ", " + report.given[static_cast<std::size_t>(f.other)].name;
  return name;
}

bool is_suspect(const DoctorReport& report, std::size_t camera) {
  const auto c = static_cast<int>(camera);
  return std::any_of(report.diagnosis.findings.begin(), report.diagnosis.findings.end(),
                     [c](const DoctorFinding& f) { return f.is_fault && (f.camera == c || f.other == c); });
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else if (c == '&')
      result += "&amp;";
    else
      result += c;
  }
  return result;
}

constexpr double kSidePx = 420, kMarginPx = 36;

/// One plane of the world on paper.
class Drawing {
 public:
  Drawing(int right_axis, int up_axis, double up_sign) : right_(right_axis), up_(up_axis), sign_(up_sign) {}
  void include(Vec3d p) {
    const Vec2d q = flat(p);
    low_ = {std::min(low_.x, q.x), std::min(low_.y, q.y)};
    high_ = {std::max(high_.x, q.x), std::max(high_.y, q.y)};
  }
  Vec2d at(Vec3d p) const {
    const double size = std::max({high_.x - low_.x, high_.y - low_.y, 1e-9});
    const double scale = (kSidePx - 2 * kMarginPx) / size;
    const Vec2d q = flat(p);
    return {kSidePx / 2 + scale * (q.x - 0.5 * (low_.x + high_.x)),
            kSidePx / 2 - scale * (q.y - 0.5 * (low_.y + high_.y))};
  }

 private:
  Vec2d flat(Vec3d p) const { return {p[right_], sign_ * p[up_]}; }
  int right_, up_;
  double sign_;
  Vec2d low_{1e300, 1e300}, high_{-1e300, -1e300};
};

void draw_camera(std::ostream& svg, const Drawing& plane, const Camera& camera, double length_m,
                 const char* color, const std::string& label) {
  const Vec3d eye = camera.center_world();
  const Vec2d from = plane.at(eye);
  const auto corner = [&](double u, double v) {
    return plane.at(eye + length_m * pixel_ray_world(camera, u, v));
  };
  const double w = camera.width_px - 1.0, h = camera.height_px - 1.0;
  const Vec2d corners[] = {corner(0, 0), corner(w, 0), corner(w, h), corner(0, h)};
  svg << "<g stroke='" << color << "' fill='none' stroke-width='1.3'><polygon points='";
  for (const Vec2d p : corners) svg << p.x << "," << p.y << " ";
  svg << "'/>";
  for (const Vec2d p : corners)
    svg << "<line x1='" << from.x << "' y1='" << from.y << "' x2='" << p.x << "' y2='" << p.y << "'/>";
  svg << "</g><circle cx='" << from.x << "' cy='" << from.y << "' r='3' fill='" << color << "'/>";
  if (!label.empty())
    svg << "<text x='" << from.x + 5 << "' y='" << from.y - 5 << "' fill='" << color << "'>" << escaped(label)
        << "</text>";
}

void draw_box(std::ostream& svg, const Drawing& plane, const Box3f& box) {
  svg << "<g stroke='#888' stroke-dasharray='4 3'>";
  for (int edge = 0; edge < 12; ++edge) {
    const int axis = edge / 4, a = (axis + 1) % 3, b = (axis + 2) % 3;
    Vec3d from, to;
    from[axis] = static_cast<double>(box.min[axis]);
    to[axis] = static_cast<double>(box.max[axis]);
    from[a] = to[a] = static_cast<double>(edge & 1 ? box.max[a] : box.min[a]);
    from[b] = to[b] = static_cast<double>(edge & 2 ? box.max[b] : box.min[b]);
    const Vec2d p = plane.at(from), q = plane.at(to);
    svg << "<line x1='" << p.x << "' y1='" << p.y << "' x2='" << q.x << "' y2='" << q.y << "'/>";
  }
  svg << "</g>";
}

std::string draw_plane(const DoctorReport& report, Drawing plane, const char* title) {
  double reach_m = 0;
  const Vec3d middle = vec_cast<double>(report.workspace_m.center());
  for (const auto* cameras : {&report.given, &report.diagnosis.cameras}) {
    for (const Camera& c : *cameras) plane.include(c.center_world());
  }
  for (const Camera& c : report.given) reach_m = std::max(reach_m, length(c.center_world() - middle));
  plane.include(vec_cast<double>(report.workspace_m.min));
  plane.include(vec_cast<double>(report.workspace_m.max));
  std::ostringstream svg;
  svg.precision(5);
  svg << "<svg xmlns='http://www.w3.org/2000/svg' width='" << kSidePx << "' height='" << kSidePx
      << "' font-family='sans-serif' font-size='11'><text x='8' y='16' fill='#333'>" << title << "</text>";
  draw_box(svg, plane, report.workspace_m);
  for (std::size_t c = 0; c < report.given.size(); ++c) {
    const bool suspect = is_suspect(report, c);
    draw_camera(svg, plane, report.given[c], 0.18 * reach_m, suspect ? "#c0392b" : "#2c5d8f",
                report.given[c].name);
    if (suspect) draw_camera(svg, plane, report.diagnosis.cameras[c], 0.18 * reach_m, "#2e8b57", "");
  }
  svg << "</svg>";
  return svg.str();
}

}  // namespace

std::string rig_drawing(const DoctorReport& report) {
  return draw_plane(report, Drawing(0, 2, -1), "from above (x right, z down)") +
         draw_plane(report, Drawing(0, 1, 1), "from the front (x right, y up)");
}

nlohmann::json doctor_json(const DoctorReport& report) {
  const Diagnosis& d = report.diagnosis;
  nlohmann::json json{{"verdict", verdict_name(d.verdict)},
                      {"why", d.why},
                      {"help", d.help},
                      {"findings", nlohmann::json::array()},
                      {"views", nlohmann::json::array()},
                      {"evidence", report.evidence},
                      {"seen_by_fewer_than_3", report.seen_by_few}};
  for (const DoctorFinding& f : d.findings)
    json["findings"].push_back({{"camera", camera_name(report, f)},
                                {"fault", f.fault},
                                {"cure", f.cure},
                                {"is_fault", f.is_fault},
                                {"recall_before", f.recall_before},
                                {"recall_after", f.recall_after}});
  for (std::size_t c = 0; c < report.given.size(); ++c)
    json["views"].push_back({{"camera", report.given[c].name},
                             {"recall_before", d.recall_before[c]},
                             {"recall_after", d.recall_after[c]}});
  return json;
}

void print_doctor(const DoctorReport& report) {
  const Diagnosis& d = report.diagnosis;
  // Findings that differ in cameras and numbers alone are told together.
  std::vector<std::string> kinds, told;
  for (const DoctorFinding& f : d.findings) {
    const std::string name = camera_name(report, f), kind = kind_of_line(f.fault + f.cure);
    const auto known = static_cast<std::size_t>(std::find(kinds.begin(), kinds.end(), kind) - kinds.begin());
    if (known < kinds.size() && f.camera >= 0 && f.other < 0) {
      told[known] += (told[known].ends_with('\n') ? "  likewise: " : ", ") + name;
      continue;
    }
    kinds.push_back(kind);
    told.push_back(name + ": " + f.fault + " (recall " + number(f.recall_before, "%.3f") + ", cured " +
                   number(f.recall_after, "%.3f") + ")\n  cure: " + f.cure + "\n");
  }
  for (const std::string& text : told) std::printf("%s%s", text.c_str(), text.ends_with('\n') ? "" : "\n");
  for (const std::string& line : report.evidence) std::printf("%s\n", line.c_str());
  std::printf("%.1f %% of the workspace is seen by fewer than three cameras\n", 100 * report.seen_by_few);
  std::printf("verdict: %s; %s\n", verdict_name(d.verdict), d.why.c_str());
  if (!d.help.empty()) std::printf("what would help: %s\n", d.help.c_str());
}

void write_doctor_html(const std::string& path, const DoctorReport& report) {
  const Diagnosis& d = report.diagnosis;
  std::ostringstream html;
  html << "<!doctype html><meta charset='utf-8'><title>tactus doctor</title><style>body{font:15px sans-serif;"
          "max-width:900px;margin:2em auto}td,th{padding:3px 12px 3px 0;text-align:left;vertical-align:top}"
          "</style><h1>"
       << escaped(report.rig) << ": " << verdict_name(d.verdict) << "</h1><p>" << escaped(d.why) << "</p>";
  if (!d.help.empty()) html << "<p>What would help: " << escaped(d.help) << "</p>";
  html << rig_drawing(report)
       << "<p>Blue: cameras as given; red: those with a fault; green: those cured; dashed: workspace.</p>";
  if (!d.findings.empty()) {
    html << "<table><tr><th>camera<th>fault<th>cure<th>recall<th>cured</tr>";
    for (const DoctorFinding& f : d.findings)
      html << "<tr><td>" << escaped(camera_name(report, f)) << "<td>" << escaped(f.fault) << "<td>"
           << escaped(f.cure) << "<td>" << number(f.recall_before, "%.3f") << "<td>"
           << number(f.recall_after, "%.3f") << "</tr>";
    html << "</table>";
  }
  html << "<h2>Views</h2><table><tr><th>camera<th>recall<th>cured</tr>";
  for (std::size_t c = 0; c < report.given.size(); ++c)
    html << "<tr><td>" << escaped(report.given[c].name) << "<td>" << number(d.recall_before[c], "%.3f")
         << "<td>" << number(d.recall_after[c], "%.3f") << "</tr>";
  html << "</table><ul>";
  for (const std::string& line : report.evidence) html << "<li>" << escaped(line) << "</li>";
  html << "<li>" << number(100 * report.seen_by_few, "%.1f")
       << " % of the workspace is seen by fewer than three cameras</li></ul>";
  SafeFile file(path);
  file.write(html.str());
  file.commit();
}

}  // namespace tactus
