#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/fluid/split_kernels.h"
#include "tactus/fluid/tension_kernels.h"
#include "tactus/fluid/wound_kernels.h"
#include "tactus/geom/search/neighbour_visit.h"

TACTUS_CUDA_KERNEL(tactus::TryWounds);
TACTUS_CUDA_KERNEL(tactus::JudgePlaces);
TACTUS_CUDA_KERNEL(tactus::PlanWounds);
TACTUS_CUDA_KERNEL(tactus::BleedWounds);
TACTUS_CUDA_KERNEL(tactus::ListLeavers);
TACTUS_CUDA_KERNEL(tactus::ListGhosts);
TACTUS_CUDA_KERNEL(tactus::PlanImport);
TACTUS_CUDA_KERNEL(tactus::TakeOver);
TACTUS_CUDA_KERNEL(tactus::InvertOrder);
TACTUS_CUDA_KERNEL(tactus::FindOriginals);
TACTUS_CUDA_KERNEL(tactus::PullGhosts<float>);
TACTUS_CUDA_KERNEL(tactus::PullGhosts<tactus::LiquidMotion>);
TACTUS_CUDA_KERNEL(tactus::PullGhosts<tactus::LiquidNormal>);
TACTUS_CUDA_KERNEL(tactus::PoisonGhosts<float>);
TACTUS_CUDA_KERNEL(tactus::PoisonGhosts<tactus::LiquidMotion>);
TACTUS_CUDA_KERNEL(tactus::PoisonGhosts<tactus::LiquidNormal>);
TACTUS_CUDA_KERNEL(tactus::CountLayers);
TACTUS_CUDA_KERNEL(tactus::MergeParts);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::FindLiquidRound>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::BeatPlaces>);
