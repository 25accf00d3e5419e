#pragma once
/// Films on obstacles, for pictures.
#include "tactus/view/scene.h"

namespace tactus {

/// A surface with a film: only those parts of its triangles on which film or stain is drawn, cut where the
/// film's height falls to 0. They lie a little above the surface, as thick as the film.
void keep_wet(TriangleMesh& surface, ViewFilm& film);

}  // namespace tactus
