#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/fluid/film/film_carry_kernels.h"
#include "tactus/geom/search/neighbour_visit.h"

TACTUS_CUDA_KERNEL(tactus::PlanFilmLink);
TACTUS_CUDA_KERNEL(tactus::BeginFilmLinks);
TACTUS_CUDA_KERNEL(tactus::CountFilmCorners);
TACTUS_CUDA_KERNEL(tactus::OpenFilmLists);
TACTUS_CUDA_KERNEL(tactus::FillFilmLists);
TACTUS_CUDA_KERNEL(tactus::SortFilmLists);
TACTUS_CUDA_KERNEL(tactus::FlagFilm);
TACTUS_CUDA_KERNEL(tactus::LiftFilm);
TACTUS_CUDA_KERNEL(tactus::RetryFilm);
TACTUS_CUDA_KERNEL(tactus::ForgetFilm);
TACTUS_CUDA_KERNEL(tactus::EndLifting);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::FindLanding>);
TACTUS_CUDA_KERNEL(tactus::LandFilm);
TACTUS_CUDA_KERNEL(tactus::SettleFilm);
TACTUS_CUDA_KERNEL(tactus::KeepWaitingFilm);
TACTUS_CUDA_KERNEL(tactus::EndWaitingFilm);
