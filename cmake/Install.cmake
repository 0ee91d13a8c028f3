# SPDX-License-Identifier: MIT
# install() and export(): what find_package(ehsid CONFIG) finds.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

set(ehsid_package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/ehsid)
target_include_directories(ehsid INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)

install(TARGETS ehsid ehsid_reproducible EXPORT ehsid)
# Headers do not depend on the architecture, a library does.
set(ehsid_architecture ARCH_INDEPENDENT)
if(EHSID_BUILD_C)
  target_include_directories(ehsid_c INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>)
  install(TARGETS ehsid_c EXPORT ehsid ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  set(ehsid_architecture "")
endif()
install(DIRECTORY cpp/include/ehsid DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} COMPONENT headers)
install(EXPORT ehsid NAMESPACE ehsid:: FILE ehsid-targets.cmake DESTINATION ${ehsid_package_dir}
        COMPONENT headers)

configure_package_config_file(cmake/ehsid-config.cmake.in ehsid-config.cmake
                              INSTALL_DESTINATION ${ehsid_package_dir})
# Before 1.0 a minor version may change the interface.
write_basic_package_version_file(ehsid-config-version.cmake COMPATIBILITY SameMinorVersion
                                 ${ehsid_architecture})
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/ehsid-config.cmake
              ${CMAKE_CURRENT_BINARY_DIR}/ehsid-config-version.cmake
              ${CMAKE_CURRENT_LIST_DIR}/LocateEigen.cmake
        DESTINATION ${ehsid_package_dir} COMPONENT headers)
