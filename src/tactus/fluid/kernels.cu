#include "tactus/compute/cuda/kernel_launch.cuh"
#include "tactus/fluid/flow_kernels.h"
#include "tactus/fluid/iisph_kernels.h"
#include "tactus/fluid/wcsph_kernels.h"

TACTUS_CUDA_KERNEL(tactus::FindBoxWalls);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::LiquidDensity, tactus::ListUse::write>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::LiquidForce, tactus::ListUse::read>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::ImplicitDensity, tactus::ListUse::write>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::ImplicitForce, tactus::ListUse::read>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::ImplicitVelocity<false>, tactus::ListUse::read>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::ImplicitVelocity<true>, tactus::ListUse::read>);
TACTUS_CUDA_KERNEL(tactus::VisitNeighbours<tactus::ImplicitPressure, tactus::ListUse::read>);
TACTUS_CUDA_KERNEL(tactus::KeepCount);
TACTUS_CUDA_KERNEL(tactus::PlanLayers);
TACTUS_CUDA_KERNEL(tactus::EmitLayers);
TACTUS_CUDA_KERNEL(tactus::SumWalls);
TACTUS_CUDA_KERNEL(tactus::ReportLiquid);
