#pragma once
/// A film on the real surface: which vertices there are, and where they and the film are.
#include "tactus/compute/atomic.h"
#include "tactus/contact/real/motion_kernels.h"
#include "tactus/fluid/film/film_carry_views.h"
#include "tactus/fluid/film/film_kernels.h"

namespace tactus {

/// Something lies on the real surface, or waits for it.
struct FindRealFilm {
  View<const FilmSums> sums;
  View<const FilmWaiting> waiting;
  View<Index> wanted;  ///< (1) whether there is anything to do
  TACTUS_HD void operator()(Index) const {
    wanted[0] = (sums[0].film | sums[0].stain | waiting[0].film | waiting[0].stain) != 0 ? 1 : 0;
  }
};

/// Thread: particle. Near the box of a component, there is something to do.
struct FindNearRealFilm {
  View<const Vec3f> x_m;
  VertexMotions of;
  View<const FrameParams> frame;
  float reach_m;
  View<Index> wanted;
  TACTUS_HD void operator()(Index i) const {
    const SurfaceComponents& all = of.now[0];
    const float age_s = abs(frame[0].surface_age_s);
    for (Index k = 0; k < all.count; ++k) {
      const SurfaceComponent& c = all.component[k];
      const SurfaceMotion& m = of.motion[k];
      const float moved = age_s * (length(m.velocity_m_s) + 0.5F * c.size_m() * length(m.spin_rad_s));
      if (c.may_reach(x_m[i], reach_m + moved)) {
        atomic_store(reinterpret_cast<std::uint32_t&>(wanted[0]), 1U);
        return;
      }
    }
  }
};

/// The vertices and triangles that the film and particles look at: none where there is nothing to do.
struct CountRealFilm {
  View<const Index> wanted;
  Count vertices, triangles;
  View<Index> counts;  ///< (2)
  TACTUS_HD void operator()(Index) const {
    counts[0] = wanted[0] != 0 ? vertices.get() : 0;
    counts[1] = wanted[0] != 0 ? triangles.get() : 0;
  }
};

/// Thread: vertex of a new mesh.
struct TagRealFilm {
  VertexMotions of;
  View<Index> tag;
  TACTUS_HD void operator()(Index v) const { tag[v] = of.component(v); }
};

/// Thread: film that was lifted off the last mesh. It moves with its component to the new capture.
struct MoveRealFilm {
  VertexMotions of;
  View<FilmPoint> point;
  View<Vec3f> place_m;
  TACTUS_HD void operator()(Index i) const {
    const Rigidf T = of.since_before(point[i].tag);
    place_m[i] = T * place_m[i];
    point[i].normal = T.R * point[i].normal;
  }
};

/// Thread: vertex. Where it is when the frame begins, and was a frame before.
struct PoseRealFilm {
  VertexMotions of;
  View<const FrameParams> frame;
  View<const Index> tag;
  View<const Vec3f> captured_m, captured_normal;
  View<Vec3f> x_m, normal, last_x_m;
  TACTUS_HD void operator()(Index v) const {
    const float age_s = frame[0].surface_age_s;
    const SurfaceMotion m = tag[v] < of.now[0].count ? of.motion[tag[v]] : SurfaceMotion{};
    const Mat3f R = m.turn(age_s);
    const Vec3f x = m.center_m + age_s * m.velocity_m_s + R * (captured_m[v] - m.center_m);
    x_m[v] = x;
    normal[v] = R * captured_normal[v];
    last_x_m[v] = x - film_frame_s(frame[0]) * m.velocity_at(x, age_s);
  }
};

}  // namespace tactus
