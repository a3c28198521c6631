#!/usr/bin/env python3
"""Holds packaging/Containerfile, compose.yaml and kubernetes/ against each other, scripts/launch.sh and the documents.

  tests/static/deployment.py ROOT

Prints what differs, a line each. Exit codes: 0 nothing, 1 something. No engine and no cluster is asked.
"""
import pathlib
import re
import sys

import yaml

errors = []


def expect(holds, error):
    if not holds:
        errors.append(error)


def check_words(where, words, launch):
    """Options of `skein launch` are launch.sh's; paths are those of the volumes, the invitation or /tmp."""
    if words[0] != 'launch':
        return
    known = set(re.findall(r'^    (--[a-z-]+)\)', launch, re.M))
    for word in words:
        if word.startswith('--'):
            expect(word in known, f'{where}: launch.sh has no option {word}')
        for path in re.findall(r'(?<![/\w.:)])/[\w/]+', word):
            expect(path.startswith(('/var/lib/skein/', '/etc/skein/invitation/', '/tmp/')), f'{where}: a path that is not kept, {path}')


def option(words, name):
    return words[words.index(name) + 1]


class Tree:
    def __init__(self, root):
        self.root = pathlib.Path(root)
        self.launch = self.read('scripts/launch.sh')
        self.version = re.search(r'^project\(skein VERSION ([\d.]+)', self.read('CMakeLists.txt'), re.M)[1]
        self.stop_s = int(re.search(r'\bstop_deadline_s=(\d+)', self.launch)[1])
        self.deploy = self.read('docs/deploy.md')

    def read(self, path):
        return (self.root / path).read_text()

    def documents(self, path):
        return list(yaml.safe_load_all(self.read(path)))


def check_containerfile(tree):
    """The image's user and ports."""
    text = tree.read('packaging/Containerfile')
    home = re.search(r'^u skein - "[^"]*" (\S+)', tree.read('packaging/sysusers.conf'), re.M)[1]
    expect(f'ENV HOME={home}\n' in text, f'Containerfile: the home of packaging/sysusers.conf is {home}')
    ports = {int(port) for port in re.search(r'^EXPOSE (.*)', text, re.M)[1].split()}
    told = re.search(r'^Ports: ([^.]*)\.', tree.deploy, re.M)[1]
    expect(ports == {int(port) for port in re.findall(r'\d{4}', told)}, f'Containerfile: docs/deploy.md says "Ports: {told}"')
    return int(re.search(r'^USER (\d+):\1$', text, re.M)[1]), ports


def check_compose(tree):
    compose = tree.documents('packaging/compose.yaml')[0]
    services = compose['services']
    for name, service in services.items():
        where = f'compose.yaml, {name}'
        expect(service['image'] == f'localhost/skein:{tree.version}', f'{where}: image {service["image"]}, and the version is {tree.version}')
        expect(service.get('read_only') and service.get('cap_drop') == ['ALL'], f'{where}: is not confined')
        expect(int(service['stop_grace_period'].rstrip('s')) > tree.stop_s, f'{where}: launch.sh may take {tree.stop_s} s to stop')
        for volume in service['volumes']:
            expect(volume.split(':')[0] in compose['volumes'], f'{where}: no volume {volume}')
        for needed in service.get('depends_on', {}):
            expect(needed in services, f'{where}: no service {needed}')
        check_words(where, service['command'], tree.launch)
    session, invitation, worker = (services[name]['command'] for name in ('session', 'invitation', 'worker'))
    expect(f'--session {option(session, "--session")} ' in invitation[1], 'compose.yaml: the invitation is for another session')
    expect(invitation[1].endswith('>' + option(worker, '--join').lstrip('@')), 'compose.yaml: the worker reads another invitation')
    expect(services['session']['healthcheck']['test'][-1] == option(session, '--ready-file'), 'compose.yaml: the health of another file')
    return session, worker


def check_pod(where, workload, tree, user):
    """A workload's template: labels, user, volumes, words."""
    template = workload['spec']['template']
    pod = template['spec']
    expect(workload['spec']['selector']['matchLabels'] == template['metadata']['labels'], f'{where}: selects other pods')
    expect(pod['securityContext']['runAsUser'] == pod['securityContext']['fsGroup'] == user, f'{where}: the image\'s user is {user}')
    expect(pod['terminationGracePeriodSeconds'] > tree.stop_s, f'{where}: launch.sh may take {tree.stop_s} s to stop')
    volumes = {volume['name'] for volume in pod['volumes']}
    volumes |= {claim['metadata']['name'] for claim in workload['spec'].get('volumeClaimTemplates', [])}
    container, = pod['containers']
    mounts = {mount['name']: mount['mountPath'] for mount in container['volumeMounts']}
    expect(set(mounts) == volumes, f'{where}: mounts {sorted(mounts)} of {sorted(volumes)}')
    expect(container['securityContext'] == {'allowPrivilegeEscalation': False, 'readOnlyRootFilesystem': True,
                                            'capabilities': {'drop': ['ALL']}}, f'{where}: is not confined')
    words = container['args']
    named = set(re.findall(r'\$\((\w+)\)', ' '.join(words)))
    expect(named == {variable['name'] for variable in container.get('env', [])}, f'{where}: env is not what args name')
    check_words(where, words, tree.launch)
    for path in re.findall(r'(?<![/\w.:)])/[\w/]+', ' '.join(words)):
        expect(any(path.startswith(mount + '/') for mount in mounts.values()), f'{where}: {path} lies in no volume')
    return container


def check_kustomization(tree, containers):
    kustomization = tree.documents('packaging/kubernetes/kustomization.yaml')[0]
    image, = kustomization['images']
    expect(image['newTag'] == tree.version, f'kustomization.yaml: image {image["newTag"]}, and the version is {tree.version}')
    for container in containers:
        expect(container['image'] == image['name'] == 'localhost/skein', f'kubernetes: image {container["image"]}')
        expect(container['imagePullPolicy'] == 'IfNotPresent', 'kubernetes: nodes would ask a registry')
    objects = [item for path in kustomization['resources'] for item in tree.documents(f'packaging/kubernetes/{path}')]
    for item in objects:
        expect(item.get('apiVersion') and item.get('kind') and item.get('metadata', {}).get('name'), f'kubernetes: no object, {item}')
    return {(item['kind'], item['metadata']['name']): item for item in objects}


def check_services(objects, session, container, ports):
    labels = session['spec']['template']['metadata']['labels']
    named = {port['name']: port['containerPort'] for port in container['ports']}
    expect(set(named.values()) == ports, f'session.yaml: ports {named}, and the image has {sorted(ports)}')
    for (kind, name), service in objects.items():
        if kind != 'Service':
            continue
        expect(service['spec']['selector'] == labels, f'session.yaml: Service {name} leads to no pod')
        expect({port['name']: port['port'] for port in service['spec']['ports']} == named, f'session.yaml: ports of Service {name}')
    governing = objects[('Service', session['spec']['serviceName'])]['spec']
    expect(governing['clusterIP'] == 'None' and governing['publishNotReadyAddresses'], 'session.yaml: the pod has no name while it starts')
    expect(f'.{session["spec"]["serviceName"]}.' in option(container['args'], '--lcm-url'), 'session.yaml: --lcm-url by another Service')
    for variable in container['env']:
        key = variable['valueFrom'].get('configMapKeyRef')
        expect(not key or key['key'] in objects[('ConfigMap', key['name'])]['data'], f'session.yaml: no value of {variable["name"]}')
    expect(container['readinessProbe']['exec']['command'][-1] == option(container['args'], '--ready-file'), 'session.yaml: ready by another file')


def check_autoscaler(objects, worker, container, tree):
    scaler = objects[('HorizontalPodAutoscaler', worker['metadata']['name'])]['spec']
    expect(scaler['scaleTargetRef']['name'] == worker['metadata']['name'], 'workers.yaml: the autoscaler scales nothing')
    expect('replicas' not in worker['spec'], 'workers.yaml: replicas would undo what the autoscaler does')
    metric, = scaler['metrics']
    rules = tree.documents('packaging/kubernetes/adapter.yaml')[0]['externalRules']
    expect(metric['external']['metric']['name'] in {rule['name']['as'] for rule in rules}, 'adapter.yaml: not the autoscaler\'s metric')
    target_s, cores = re.search(r'--target (\d+) --cores (\d+)', tree.read('packaging/kubernetes/workers.yaml')).groups()
    expect(int(metric['external']['target']['averageValue']) == int(target_s) * int(cores), 'workers.yaml: not --target x --cores')
    expect(container['resources']['requests']['cpu'] == cores, f'workers.yaml: a worker has {cores} cores')
    volume = next(volume for volume in worker['spec']['template']['spec']['volumes'] if 'secret' in volume)
    expect(f'secret generic {volume["secret"]["secretName"]} --from-file=link' in tree.deploy, 'workers.yaml: docs/deploy.md makes another Secret')


def check_scrape(tree, objects, labels):
    job, = tree.documents('packaging/kubernetes/scrape.yaml')[0]['scrape_configs']
    keep = job['relabel_configs'][0]
    expect(job['tls_config']['server_name'] == objects[('ConfigMap', 'skein')]['data']['host'], 'scrape.yaml: another host than session.yaml\'s')
    expect(keep['regex'] == ';'.join([*labels.values(), 'web']), f'scrape.yaml: keeps {keep["regex"]}')


def main():
    tree = Tree(sys.argv[1])
    user, ports = check_containerfile(tree)
    composed_session, composed_worker = check_compose(tree)
    session = next(item for item in tree.documents('packaging/kubernetes/session.yaml') if item['kind'] == 'StatefulSet')
    worker = next(item for item in tree.documents('packaging/kubernetes/workers.yaml') if item['kind'] == 'Deployment')
    session_container = check_pod('session.yaml', session, tree, user)
    worker_container = check_pod('workers.yaml', worker, tree, user)
    objects = check_kustomization(tree, [session_container, worker_container])
    check_services(objects, session, session_container, ports)
    check_autoscaler(objects, worker, worker_container, tree)
    check_scrape(tree, objects, session['spec']['template']['metadata']['labels'])
    expect(worker_container['args'] == composed_worker, 'compose.yaml and workers.yaml: workers of other options')
    folder = option(composed_session, '--session')
    expect(folder == option(session_container['args'], '--session'), 'compose.yaml and session.yaml: other sessions')
    print(*errors, sep='\n')
    print(f'{len(objects)} objects, {len(ports)} ports')
    return 1 if errors else 0


if __name__ == '__main__':
    sys.exit(main())
