#pragma once
/// Fields of a scene's regions, and helpers that several declarations of fields share.
#include "tactus/io/field_visitor.h"

namespace tactus {

inline constexpr Presence kRequired = Presence::required;
inline constexpr Range kPosition{"m", -1000, 1000};
/// Beyond 0.499 explicit steps become hopelessly small.
inline constexpr Range kPoisson{"", -0.99, 0.499};
inline Range positive(const char* unit, double max) { return {unit, 0, max, true}; }

/// Elements of a list of the scene; a description is used before the next element is added.
template <class T>
FieldVisitor::Items items_of(std::vector<T>& items, void (*describe)(FieldVisitor&, T&)) {
  const auto at = [&items, describe](std::size_t k) -> FieldVisitor::Describe {
    return [&item = items[k], describe](FieldVisitor& v) { describe(v, item); };
  };
  return {[&items, at] {
            items.emplace_back();
            return at(items.size() - 1);
          },
          [&items] { return items.size(); }, at};
}

/// The part of a scene that is there, or a new one.
template <class T>
T& given(std::optional<T>& part) {
  return part ? *part : part.emplace();
}

/// A name that files are called by, or results: it must stay in its folder and on its line.
void describe_name(FieldVisitor& v, const Field& field, std::string& name);

void describe_box(FieldVisitor& v, BoxRegion& box);
void describe_fluid(FieldVisitor& v, LiquidDescription& f);
void describe_fixed(FieldVisitor& v, FixedRegion& f);
void describe_painted(FieldVisitor& v, PaintedRegion& r);
void describe_moved(FieldVisitor& v, MovedRegion& m);
void describe_load(FieldVisitor& v, LoadedRegion& l);
void describe_placement(FieldVisitor& v, PlacementDescription& p);
void describe_obstacle(FieldVisitor& v, ObstacleSetting& o);
void describe_tracked(FieldVisitor& v, TrackedBladeDescription& t);
void describe_plan(FieldVisitor& v, PlanDescription& p);
/// Each is for a body that is cuttable.
void check_plans(FieldVisitor& v, const Scene& scene);
/// There is something that they may cut.
void check_blades(FieldVisitor& v, const Scene& scene);
/// `body` or `world`.
void describe_frame_of(FieldVisitor& v, CoordinateFrame& frame);

/// Names that must differ, and those that something must have.
void check_names(FieldVisitor& v, const Scene& scene);

}  // namespace tactus
