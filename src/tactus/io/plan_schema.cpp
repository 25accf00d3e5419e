/// Lines that blades are to follow.
#include <algorithm>

#include "tactus/base/error.h"
#include "tactus/io/region_schema.h"

namespace tactus {

void describe_plan(FieldVisitor& v, PlanDescription& p) {
  describe_name(v, {"name", "unique name in the results", kRequired}, p.name);
  v.text({"body", "name of the body that is to be cut there", kRequired}, p.body);
  describe_frame_of(v, p.frame);
  v.list(
      {"line", "points on the body's surface at rest, each at most a spacing from it; so is what is between",
       kRequired},
      items_of(
          p.line, +[](FieldVisitor& in, Vec3d& at) {
            in.vector({"at", "a point of the line", kRequired}, at, kPosition);
          }));
  v.real_or_auto({"tolerance_m", "the line is followed where a cut is as near"}, p.tolerance_m,
                 positive("m", 1), "`spacing_m` of the body");
  v.check(p.line.size() >= 2, "line",
          "'line' has " + std::to_string(p.line.size()) + " points, expected two or more");
}

void check_plans(FieldVisitor& v, const Scene& scene) {
  std::vector<std::string> names;
  for (const BodyDescription& body : scene.bodies) names.push_back(body.name);
  for (const PlanDescription& plan : scene.plans) {
    const auto body = std::find(names.begin(), names.end(), plan.body);
    v.check(body != names.end(), "plans",
            "plan '" + plan.name + "' is for the unknown body '" + plan.body + "'" +
                (names.empty() ? "; the scene has no bodies" : suggestion(plan.body, names)));
    if (body == names.end()) continue;
    v.check(scene.bodies[static_cast<std::size_t>(body - names.begin())].cuttable, "plans",
            "plan '" + plan.name + "' is for body '" + plan.body + "', which has no 'cuttable: true'");
  }
}

}  // namespace tactus
