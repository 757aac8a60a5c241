# The Debian package `ignis-lio`: packaging/build_package makes it. Everything is in the component `vehicle`.

set(_programs l1_driver l1_tool lio_frontend graph_backend map_builder lio_replay graph_optimiser)
set(_home lib/ignis-lio)
find_package(Python3 REQUIRED COMPONENTS Interpreter)

set(_pages)
foreach(program IN LISTS _programs)
  set(_page ${CMAKE_BINARY_DIR}/man/${program}.1.gz)
  add_custom_command(OUTPUT ${_page}
    COMMAND ${CMAKE_COMMAND} -E make_directory ${CMAKE_BINARY_DIR}/man
    COMMAND ${Python3_EXECUTABLE} ${CMAKE_SOURCE_DIR}/packaging/make_man_page ${PROJECT_VERSION} ${_page}
            $<TARGET_FILE:${program}>
    DEPENDS ${program} packaging/make_man_page COMMENT "Manual page of ${program}" VERBATIM)
  list(APPEND _pages ${_page})
endforeach()
set(_page ${CMAKE_BINARY_DIR}/man/ignis.1.gz)
add_custom_command(OUTPUT ${_page}
  COMMAND ${Python3_EXECUTABLE} ${CMAKE_SOURCE_DIR}/packaging/make_man_page ${PROJECT_VERSION} ${_page}
          ${CMAKE_SOURCE_DIR}/packaging/deb/ignis
  DEPENDS packaging/make_man_page packaging/deb/ignis COMMENT "Manual page of ignis" VERBATIM)
add_custom_target(man_pages DEPENDS ${_pages} ${_page})

install(TARGETS ${_programs} RUNTIME DESTINATION ${_home}/bin COMPONENT vehicle)
install(PROGRAMS packaging/deb/ignis DESTINATION bin COMPONENT vehicle)
install(DIRECTORY ${CMAKE_BINARY_DIR}/man/ DESTINATION share/man/man1 COMPONENT vehicle)
install(FILES ${CMAKE_BINARY_DIR}/share/ignis_types.jar config/schema.json DESTINATION share/ignis-lio COMPONENT vehicle)
install(FILES config/ignis8_tuned.json DESTINATION /etc/ignis-lio RENAME config.json COMPONENT vehicle)
install(FILES config/schema.json DESTINATION /etc/ignis-lio COMPONENT vehicle)
install(DIRECTORY python/ignis DESTINATION ${_home}/python COMPONENT vehicle PATTERN __pycache__ EXCLUDE)
install(DIRECTORY ${CMAKE_BINARY_DIR}/python/ignis_lcm DESTINATION ${_home}/python COMPONENT vehicle
        PATTERN __pycache__ EXCLUDE)
# LCM's Python module looks for its tools, and these for their jars, beside itself.
file(GLOB _lcm_module ${LCM_PREFIX}/lcm)
install(DIRECTORY ${_lcm_module} DESTINATION ${_home}/python COMPONENT vehicle USE_SOURCE_PERMISSIONS
        PATTERN __pycache__ EXCLUDE)
install(DIRECTORY ${LCM_PREFIX}/bin DESTINATION ${_home}/python COMPONENT vehicle USE_SOURCE_PERMISSIONS
        FILES_MATCHING PATTERN "lcm-*")
install(DIRECTORY ${LCM_PREFIX}/share/java DESTINATION ${_home}/python/share COMPONENT vehicle)
install(DIRECTORY packaging/systemd/ DESTINATION lib/systemd/system COMPONENT vehicle)
install(FILES packaging/deb/60-ignis-l1.rules DESTINATION lib/udev/rules.d COMPONENT vehicle)
install(FILES packaging/deb/60-ignis-lio.conf DESTINATION lib/sysctl.d COMPONENT vehicle)
install(FILES packaging/deb/sysusers.conf DESTINATION lib/sysusers.d RENAME ignis-lio.conf COMPONENT vehicle)
install(FILES packaging/deb/completion.bash DESTINATION share/bash-completion/completions RENAME ignis
        COMPONENT vehicle)
install(DIRECTORY docs/ DESTINATION share/doc/ignis-lio COMPONENT vehicle FILES_MATCHING PATTERN "*.md")
install(FILES LICENSE DESTINATION share/doc/ignis-lio RENAME copyright COMPONENT vehicle)

set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME ignis-lio)
set(CPACK_PACKAGE_CONTACT "IGNIS LIO maintainers <ignis@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY ${PROJECT_DESCRIPTION})
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_COMPONENTS_ALL vehicle)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_VEHICLE_PACKAGE_NAME ignis-lio)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
# Libraries are added by packaging/build_package. LCM's Python module in its wheel is for one Python: Debian 13's.
set(CPACK_DEBIAN_PACKAGE_DEPENDS "python3 (>= 3.13), python3 (<< 3.14), python3-numpy, iproute2, passwd")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "default-jre | java-runtime, s6")
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA
    "${CMAKE_SOURCE_DIR}/packaging/deb/postinst;${CMAKE_SOURCE_DIR}/packaging/deb/prerm"
    "${CMAKE_SOURCE_DIR}/packaging/deb/postrm;${CMAKE_SOURCE_DIR}/packaging/deb/conffiles")
include(CPack)
