#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/fluid/film/film_exchange_kernels.h"
#include "tactus/geom/search/neighbour_visit.h"

TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::FindFilmVertex>);
TACTUS_CUDA_KERNEL(tactus::ChooseTaken);
TACTUS_CUDA_KERNEL(tactus::LargestKey);
TACTUS_CUDA_KERNEL(tactus::TakeParticles);
TACTUS_CUDA_KERNEL(tactus::KeyThickFilm);
TACTUS_CUDA_KERNEL(tactus::FlagGivers);
TACTUS_CUDA_KERNEL(tactus::PlaceGiven);
TACTUS_CUDA_KERNEL(tactus::FlagGiven);
TACTUS_CUDA_KERNEL(tactus::PlanGiven);
TACTUS_CUDA_KERNEL(tactus::GiveParticles);
