# find_package(tactus [COMPONENTS module ...]): static libraries tactus::<module>, headers, and the flags that keep one answer on every device.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

get_property(modules GLOBAL PROPERTY TACTUS_MODULES)
install(TARGETS ${modules} tactus_settings EXPORT tactusTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
install(DIRECTORY include/tactus DESTINATION ${CMAKE_INSTALL_INCLUDEDIR} FILES_MATCHING PATTERN "*.h" PATTERN "*.cuh")
set_target_properties(tactus_settings PROPERTIES EXPORT_NAME settings)
install(EXPORT tactusTargets NAMESPACE tactus:: DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/tactus)
get_property(TACTUS_COMPONENT_FACTS GLOBAL PROPERTY TACTUS_COMPONENT_FACTS)
configure_package_config_file(cmake/tactusConfig.cmake.in ${CMAKE_BINARY_DIR}/tactusConfig.cmake
                              INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/tactus)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/tactusConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/tactusConfig.cmake ${CMAKE_BINARY_DIR}/tactusConfigVersion.cmake cmake/FindOpenCV.cmake
        DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/tactus)
install(DIRECTORY scenes rigs DESTINATION ${CMAKE_INSTALL_DATADIR}/tactus)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} FILES_MATCHING PATTERN "*.md" PATTERN "*.png")
# As in the sources, so that links between them hold (tests/package/installed_links.py).
install(DIRECTORY examples DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY python/examples DESTINATION ${CMAKE_INSTALL_DOCDIR}/python FILES_MATCHING PATTERN "*.py")
install(FILES LICENSE README.md ARCHITECTURE.md CONTRIBUTING.md CHANGELOG.md CITATION.cff SECURITY.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
if(TARGET tactus)
  install(TARGETS tactus RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
  install(PROGRAMS ${CMAKE_BINARY_DIR}/tactus-bench DESTINATION ${CMAKE_INSTALL_BINDIR} OPTIONAL)  # where it was built
  # (Written by the program as it is built.)
  install(FILES ${CMAKE_BINARY_DIR}/help/tactus.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
  install(FILES ${CMAKE_BINARY_DIR}/help/tactus.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME tactus)
  install(FILES ${CMAKE_BINARY_DIR}/help/_tactus DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions)
  install(FILES ${CMAKE_BINARY_DIR}/help/tactus.fish DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
endif()
