# The module for Python: a package of files from src/python/train_derail with the extension _core beside them. In catkin's devel
# space it shares its folder with the messages that genpy makes.

set(train_derail_python_source ${CMAKE_CURRENT_SOURCE_DIR}/src/python/train_derail)
set(train_derail_python_files __init__.py __init__.pyi _api.py _core.pyi _tables.py py.typed)

# Debian's Python, whatever shadows it.
macro(train_derail_find_python)
  if(NOT PYTHON_EXECUTABLE AND EXISTS /usr/bin/python3)
    set(PYTHON_EXECUTABLE /usr/bin/python3 CACHE FILEPATH "Python that the module is for")
  endif()
  if(NOT DEFINED TRAIN_DERAIL_PYTHON OR TRAIN_DERAIL_PYTHON)
    find_package(pybind11 CONFIG QUIET)
  endif()
  set(train_derail_python_wanted ${pybind11_FOUND})
  if(TRAIN_DERAIL_SANITIZE OR TRAIN_DERAIL_FUZZ)
    set(train_derail_python_wanted OFF)  # Python itself would have to be built so
  endif()
  option(TRAIN_DERAIL_PYTHON "Build the module for Python (pybind11)" ${train_derail_python_wanted})
  if(TRAIN_DERAIL_PYTHON AND NOT pybind11_FOUND)
    message(FATAL_ERROR "TRAIN_DERAIL_PYTHON is ON, but pybind11 was not found (Debian: pybind11-dev)")
  elseif(NOT TRAIN_DERAIL_PYTHON)
    message(STATUS "The module for Python is left out (TRAIN_DERAIL_PYTHON; Debian: pybind11-dev)")
  endif()
endmacro()

# Puts the files into `folder`/train_derail. To be called before generate_messages(): genpy makes an empty __init__.py where it finds none,
# and installs the one that it finds unless it is told that the package has its own.
macro(train_derail_python_package folder)
  set(train_derail_python_folder ${folder}/train_derail)
  foreach(name ${train_derail_python_files})
    configure_file(${train_derail_python_source}/${name} ${train_derail_python_folder}/${name} COPYONLY)
  endforeach()
  get_filename_component(train_derail_source package.xml REALPATH)
  get_filename_component(train_derail_source ${train_derail_source} DIRECTORY)
  file(WRITE ${train_derail_python_folder}/_place.py "DATA = '${train_derail_source}'\n")
  set(${PROJECT_NAME}_CATKIN_PYTHON_SETUP_HAS_PACKAGE_INIT TRUE)
endmacro()

# The extension, and the installation into `site`, a folder below the prefix. `libraries` and `data`: where those are.
macro(train_derail_python_module site libraries data)
  pybind11_add_module(${PROJECT_NAME}_python MODULE NO_EXTRAS src/python/module.cpp)
  target_include_directories(${PROJECT_NAME}_python PRIVATE ${CMAKE_CURRENT_SOURCE_DIR}/src)
  target_link_libraries(${PROJECT_NAME}_python PRIVATE ${PROJECT_NAME})
  # It computes nothing.
  target_compile_options(${PROJECT_NAME}_python PRIVATE $<$<CONFIG:Release>:-O1>)
  file(RELATIVE_PATH train_derail_to_libraries "/${site}/train_derail" "/${libraries}")
  file(RELATIVE_PATH train_derail_to_data "/${site}/train_derail" "/${data}")
  set_target_properties(${PROJECT_NAME}_python PROPERTIES
    OUTPUT_NAME _core
    LIBRARY_OUTPUT_DIRECTORY ${train_derail_python_folder}
    INSTALL_RPATH "\$ORIGIN/${train_derail_to_libraries}"
  )
  foreach(name ${train_derail_python_files})
    install(FILES ${train_derail_python_folder}/${name} DESTINATION ${site}/train_derail)
  endforeach()
  install(TARGETS ${PROJECT_NAME}_python LIBRARY DESTINATION ${site}/train_derail)
  # After genpy, which has installed the one of the devel space.
  set(train_derail_place ${CMAKE_CURRENT_BINARY_DIR}/python_installed/_place.py)
  file(WRITE ${train_derail_place} "DATA = '${train_derail_to_data}'\n")
  install(CODE "file(REMOVE \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${site}/train_derail/_place.py\")")
  install(FILES ${train_derail_place} DESTINATION ${site}/train_derail)
endmacro()
