#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/fluid/film/film_kernels.h"
#include "tactus/fluid/film/film_region_kernels.h"

TACTUS_CUDA_KERNEL(tactus::NoteWetFilm);
TACTUS_CUDA_KERNEL(tactus::KeepWetFilm);
TACTUS_CUDA_KERNEL(tactus::MarkFilmRing);
TACTUS_CUDA_KERNEL(tactus::CountFilmRegion);
TACTUS_CUDA_KERNEL(tactus::ListFilmTriangles);
TACTUS_CUDA_KERNEL(tactus::MeasureFilmTriangles);
TACTUS_CUDA_KERNEL(tactus::MeasureFilmVertices);
TACTUS_CUDA_KERNEL(tactus::FindFilmRates);
TACTUS_CUDA_KERNEL(tactus::PlanFilmPasses);
TACTUS_CUDA_KERNEL(tactus::PressFilm);
TACTUS_CUDA_KERNEL(tactus::FlowFilm);
TACTUS_CUDA_KERNEL(tactus::GatherFilm);
TACTUS_CUDA_KERNEL(tactus::DryFilm);
TACTUS_CUDA_KERNEL(tactus::SumFilm);
