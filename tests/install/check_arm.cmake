# SPDX-License-Identifier: MIT
# Links consumer/ and consumer_c/ for a Cortex-M4F at -Os: WAY is find_package, add_subdirectory or copy. The image
# of the one in C must hold nothing that check_image.cmake forbids.
cmake_minimum_required(VERSION 3.22)
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)
set(work ${BUILD}/tests/install/arm_${WAY})
file(REMOVE_RECURSE ${work})
set(settings -G ${GENERATOR} -D CMAKE_TOOLCHAIN_FILE=${SOURCE}/cmake/arm-none-eabi.cmake
             -D CMAKE_BUILD_TYPE=MinSizeRel -D Eigen3_DIR=${EIGEN})

if(WAY STREQUAL "copy")
  # No build system: the headers, and of the C API the policy that is wanted.
  file(COPY ${SOURCE}/cpp/include/ehsid DESTINATION ${work}/include PATTERN plant EXCLUDE)
  file(COPY ${SOURCE}/cpp/src/c_api.cpp ${SOURCE}/cpp/src/c_kernel.hpp ${SOURCE}/cpp/src/c_kernels.cpp
       DESTINATION ${work}/src)
  set(flags -mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16 -Os -DNDEBUG -I${work}/include
            -ffunction-sections -fdata-sections)
  set(cpp arm-none-eabi-g++ -std=c++17 -fno-exceptions -fno-rtti -fno-threadsafe-statics
          -fno-math-errno -ffp-contract=off -isystem ${EIGEN_INCLUDE} ${flags})
  set(link -nostartfiles -nodefaultlibs -Wl,--gc-sections -Wl,--entry=main)
  set(user ${CMAKE_CURRENT_LIST_DIR}/consumer_c)
  run(${cpp} -c ${work}/src/c_api.cpp -o ${work}/c_api.o)
  run(${cpp} -D EHSID_POLICY=constant -c ${work}/src/c_kernels.cpp -o ${work}/constant.o)
  run(arm-none-eabi-gcc -std=c99 ${flags} ${link} ${user}/main.c ${user}/controller.c ${work}/c_api.o
      ${work}/constant.o -lc -lgcc -o ${work}/consumer_c)
  run(${cpp} ${link} ${CMAKE_CURRENT_LIST_DIR}/consumer/consumer.cpp -lm -lc -lgcc -o
      ${work}/consumer)
  set(image ${work}/consumer_c)
else()
  if(WAY STREQUAL "find_package")
    run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${work}/prefix)
    set(where -D CMAKE_PREFIX_PATH=${work}/prefix)
  else()
    set(where -D EHSID_SOURCE=${SOURCE})
  endif()
  foreach(consumer IN ITEMS consumer consumer_c)
    run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR}/${consumer} -B ${work}/${consumer} ${settings} ${where})
    run(${CMAKE_COMMAND} --build ${work}/${consumer})
  endforeach()
  set(image ${work}/consumer_c/consumer_c)
endif()
run(${CMAKE_COMMAND} -D IMAGE=${image} -D NM=arm-none-eabi-nm -P ${SOURCE}/tests/firmware/check_image.cmake)
run(arm-none-eabi-size ${image})
