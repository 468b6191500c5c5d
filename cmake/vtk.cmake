# VTK comes with libpcl-dev. VTKConfig.cmake finds all that it stands on: find by hand the modules that tests and examples use, as
# tankrig_vtk_MODULE.
find_path(VTK_INCLUDE_DIR vtkVersionMacros.h PATH_SUFFIXES vtk-9.1 vtk-9.2 vtk-9.3 REQUIRED)
foreach(module CommonCore CommonDataModel CommonExecutionModel IOImage)
  find_library(VTK_${module}_LIBRARY NAMES vtk${module}-9.1 vtk${module}-9.2 vtk${module}-9.3 REQUIRED)
  add_library(tankrig_vtk_${module} UNKNOWN IMPORTED GLOBAL)
  set_target_properties(tankrig_vtk_${module} PROPERTIES IMPORTED_LOCATION "${VTK_${module}_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${VTK_INCLUDE_DIR}")
endforeach()
