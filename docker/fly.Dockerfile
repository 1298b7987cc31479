# The part of e2efly that flies, without JAX, for x86-64 and arm64. From the root of the repository:
#   docker buildx build --platform linux/arm64 -f docker/fly.Dockerfile -t e2efly-fly --load .
#   docker run --rm -it --network host --device /dev/ttyACM0 --cap-add SYS_NICE --ulimit rtprio=20 --stop-timeout 600 -v "$PWD/flights:/data/flights" e2efly-fly fly hover --check
FROM python:3.13-slim

WORKDIR /opt/e2efly
COPY constraints.txt LICENSE ./
COPY onboard ./onboard
COPY src ./src
RUN pip install --no-cache-dir -c constraints.txt ./onboard

RUN useradd --create-home --groups dialout,video pilot && mkdir -p /data/flights && chown -R pilot /data
USER pilot
WORKDIR /data
# a container ends with its first process: this one waits for the watchdog, which lands the vehicle if the bridge dies
ENTRYPOINT ["python", "-m", "e2efly.flight.scripts.first", "e2efly"]
CMD ["fly", "--help"]
