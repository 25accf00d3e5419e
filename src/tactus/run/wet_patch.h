#pragma once
/// Films on obstacles, for pictures.
#include "tactus/view/scene.h"

namespace tactus {

/// Keeps, where lay_film() laid a film on a surface, only those parts of its triangles on which film or stain
/// is drawn, cut along the film's edge. They lie a little above the surface, as thick as the film. At
/// creases, where a surface has several vertices at one place, the drawn film has no gap and ends on
/// the surface.
void keep_wet(TriangleMesh& surface, ViewFilm& film);

}  // namespace tactus
