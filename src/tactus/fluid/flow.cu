#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/fluid/cap_kernels.h"
#include "tactus/fluid/dfsph_kernels.h"
#include "tactus/fluid/flow_kernels.h"
#include "tactus/fluid/tension_kernels.h"
#include "tactus/fluid/wall_kernels.h"
#include "tactus/fluid/wcsph_kernels.h"
#include "tactus/geom/search/visit_both.h"

TACTUS_CUDA_KERNEL(tactus::FindBoxWalls);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::LiquidDensity<false>, tactus::ListUse::write>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::LiquidDensity<true>, tactus::ListUse::write>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::LiquidForce<false>, tactus::ListUse::read>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::LiquidForce<true>, tactus::ListUse::read>);
TACTUS_CUDA_KERNEL(
    tactus::VisitNeighbours<tactus::PulledBySurface<tactus::LiquidForce<false>>, tactus::ListUse::read>);
TACTUS_CUDA_KERNEL(
    tactus::VisitNeighbours<tactus::PulledBySurface<tactus::LiquidForce<true>>, tactus::ListUse::read>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::DfsphNeighbours, tactus::ListUse::write>);
TACTUS_CUDA_KERNEL(tactus::DfsphDensity);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::DfsphForce<false>, tactus::ListUse::read>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::DfsphForce<true>, tactus::ListUse::read>);
TACTUS_CUDA_KERNEL(
    tactus::VisitNeighbours<tactus::PulledBySurface<tactus::DfsphForce<false>>, tactus::ListUse::read>);
TACTUS_CUDA_KERNEL(
    tactus::VisitNeighbours<tactus::PulledBySurface<tactus::DfsphForce<true>>, tactus::ListUse::read>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::DfsphVelocity<false>, tactus::ListUse::read>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::DfsphVelocity<true>, tactus::ListUse::read>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::DfsphPressure, tactus::ListUse::read>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::LiquidShear, tactus::ListUse::read>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::SmoothNormals, tactus::ListUse::read>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::VisitBoth<tactus::SmoothNormals, tactus::LiquidShear>,
                                           tactus::ListUse::read>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::FindCurvature, tactus::ListUse::read>);
TACTUS_CUDA_KERNEL(tactus::TakeMotion);
TACTUS_CUDA_KERNEL(tactus::KeepCount);
TACTUS_CUDA_KERNEL(tactus::PlanEmission);
TACTUS_CUDA_KERNEL(tactus::EmitParticles);
TACTUS_CUDA_KERNEL(tactus::PassTime);
TACTUS_CUDA_KERNEL(tactus::SumWalls);
TACTUS_CUDA_KERNEL(tactus::ReportLiquid);
TACTUS_CUDA_KERNEL(tactus::KeepYoungest);
