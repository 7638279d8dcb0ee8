# Lets `cmake --install` choose the prefix, as DESTDIR chooses the root. catkin writes the prefix of configure time into what it
# generates and installs its set-up scripts there whatever is asked for. While it does so, a placeholder stands for the prefix;
# what it generated is installed here, and the placeholder is replaced then.

# To be included before find_package(catkin).
macro(train_derail_hide_prefix)
  if(CMAKE_SOURCE_DIR STREQUAL CMAKE_CURRENT_SOURCE_DIR AND NOT CATKIN_BUILD_BINARY_PACKAGE AND NOT CMAKE_INSTALL_PREFIX STREQUAL "/usr")
    set(train_derail_prefix "${CMAKE_INSTALL_PREFIX}")
    set(CMAKE_INSTALL_PREFIX "/prefix_of_train_derail")
    set(CATKIN_INSTALL_INTO_PREFIX_ROOT FALSE)
  endif()
endmacro()

# To be called after catkin_package().
macro(train_derail_restore_prefix)
  if(train_derail_prefix)
    set(CMAKE_INSTALL_PREFIX "${train_derail_prefix}")
    file(WRITE "${CMAKE_BINARY_DIR}/catkin_generated/installspace/.catkin" "")
    set(root_files .catkin .rosinstall local_setup.bash local_setup.sh local_setup.zsh setup.bash setup.sh setup.zsh)
    list(TRANSFORM root_files PREPEND "${CMAKE_BINARY_DIR}/catkin_generated/installspace/")
    install(FILES ${root_files} DESTINATION .)
    install(PROGRAMS
      "${CATKIN_DEVEL_PREFIX}/_setup_util.py"
      "${CMAKE_BINARY_DIR}/catkin_generated/installspace/env.sh"
      DESTINATION .
    )
    install(CODE "
      get_filename_component(prefix \"\${CMAKE_INSTALL_PREFIX}\" ABSOLUTE)
      foreach(name .rosinstall local_setup.sh setup.sh lib/pkgconfig/${PROJECT_NAME}.pc
          share/${PROJECT_NAME}/cmake/${PROJECT_NAME}Config.cmake)
        set(path \"\$ENV{DESTDIR}\${prefix}/\${name}\")
        set(written \"\${prefix}\")
        if(name MATCHES \"cmake\$|pc\$\")
          string(REPLACE \" \" \"\\\\ \" written \"\${prefix}\")
        endif()
        file(READ \"\${path}\" text)
        string(REPLACE /prefix_of_train_derail \"\${written}\" text \"\${text}\")
        file(WRITE \"\${path}\" \"\${text}\")
      endforeach()
    ")
  endif()
endmacro()
